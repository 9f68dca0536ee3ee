#include "simulate/shapes.h"

#include <cmath>
#include <map>
#include <tuple>

#include "scene/files/mesh_io.h"
#include "scene/program/error.h"
#include "simulate/noise.h"

namespace lumi {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
constexpr double kPi = 3.14159265358979323846;

// Object space, before scale and placement.
struct Builder {
  std::vector<Vector3d> x, n;
  std::vector<Vector2d> uv;
  std::vector<std::array<std::int32_t, 3>> faces;
  std::vector<std::uint8_t> part;

  std::int32_t Add(const Vector3d& position, const Vector3d& normal, const Vector2d& texture) {
    x.push_back(position);
    n.push_back(normal);
    uv.push_back(texture);
    return static_cast<std::int32_t>(x.size()) - 1;
  }
  void Face(std::int32_t a, std::int32_t b, std::int32_t c, std::uint8_t which = 0) {
    faces.push_back({a, b, c});
    part.push_back(which);
  }
  // A rectangle about `centre`, spanned by half edges; normal = u x v. uv in world units, origin at its first corner,
  // `shift` keeps the sides of a box from showing the same piece of a texture.
  void Rectangle(const Vector3d& centre, const Vector3d& half_u, const Vector3d& half_v, std::uint8_t which = 0,
                 const Vector2d& shift = Vector2d::Zero()) {
    const Vector3d normal = half_u.cross(half_v).normalized();
    const Vector2d size(2 * half_u.norm(), 2 * half_v.norm());
    const std::int32_t a = Add(centre - half_u - half_v, normal, shift);
    Add(centre + half_u - half_v, normal, shift + Vector2d(size.x(), 0));
    Add(centre + half_u + half_v, normal, shift + size);
    Add(centre - half_u + half_v, normal, shift + Vector2d(0, size.y()));
    Face(a, a + 1, a + 2, which);
    Face(a, a + 2, a + 3, which);
  }
};

Builder Box(const Vector3d& size) {
  Builder b;
  const Vector3d h = 0.5 * size;
  const Vector3d x = Vector3d::UnitX() * h.x(), y = Vector3d::UnitY() * h.y(), z = Vector3d::UnitZ() * h.z();
  // Each side's v points up (the top's: away from the front), so that letters stand upright.
  b.Rectangle(-y, x, z, 0, {0, 0});
  b.Rectangle(x, y, z, 0, {1.37, 0.71});
  b.Rectangle(y, -x, z, 0, {2.91, 1.33});
  b.Rectangle(-x, -y, z, 0, {4.23, 2.17});
  b.Rectangle(z, x, y, 0, {5.77, 3.19});
  b.Rectangle(-z, -x, y, 0, {7.13, 4.41});
  return b;
}

// Seen from inside: floor, left (-x), ceiling, right (+x); open at both ends. Stands on z = 0, begins at y = 0.
Builder Tube(const Vector3d& size) {
  Builder b;
  const double w = 0.5 * size.x(), l = 0.5 * size.y(), h = 0.5 * size.z();
  const Vector3d x = Vector3d::UnitX() * w, y = Vector3d::UnitY() * l, z = Vector3d::UnitZ() * h;
  b.Rectangle({0, l, 0}, x, y, 0);
  b.Rectangle({-w, l, h}, y, z, 1);
  b.Rectangle({0, l, 2 * h}, -x, y, 2);
  b.Rectangle({w, l, h}, -y, z, 3);
  return b;
}

// A grid of (rows + 1) x (columns + 1) vertices becomes triangles; counter-clockwise when columns run to the right and
// rows upwards, seen from outside.
void GridFaces(Builder& b, std::int32_t first, int columns, int rows) {
  const std::int32_t stride = columns + 1;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const std::int32_t a = first + j * stride + i;
      b.Face(a, a + 1, a + stride + 1);
      b.Face(a, a + stride + 1, a + stride);
    }
}

// Points on the circle that close exactly: the last is the first, to the bit.
Vector2d OnCircle(int i, int n) {
  const double angle = 2 * kPi * (i % n) / n;
  return {std::cos(angle), std::sin(angle)};
}

Builder Sphere(double radius, int segments) {
  Builder b;
  const int rows = std::max(2, segments / 2);
  for (int j = 0; j <= rows; ++j) {
    const double latitude = kPi * (static_cast<double>(j) / rows - 0.5);
    const double r = j == 0 || j == rows ? 0.0 : std::cos(latitude);
    const double z = j == 0 ? -1.0 : (j == rows ? 1.0 : std::sin(latitude));
    for (int i = 0; i <= segments; ++i) {
      const Vector2d c = OnCircle(i, segments);
      const Vector3d n(r * c.x(), r * c.y(), z);
      b.Add(radius * n, n, {radius * 2 * kPi * i / segments, radius * latitude});
    }
  }
  GridFaces(b, 0, segments, rows);
  return b;
}

// Stands on z = 0, closed at both ends.
Builder Cylinder(double radius, double top_radius, double height, int segments) {
  Builder b;
  const double slope = (radius - top_radius) / height;
  for (int j = 0; j <= 1; ++j)
    for (int i = 0; i <= segments; ++i) {
      const Vector2d c = OnCircle(i, segments);
      const double r = j == 0 ? radius : top_radius;
      b.Add({r * c.x(), r * c.y(), j * height}, Vector3d(c.x(), c.y(), slope).normalized(),
            {radius * 2 * kPi * i / segments, j * height});
    }
  GridFaces(b, 0, segments, 1);
  for (int end = 0; end <= 1; ++end) {
    const double r = end == 0 ? radius : top_radius;
    if (r <= 0) continue;
    const Vector3d n(0, 0, end == 0 ? -1 : 1);
    const std::int32_t centre = b.Add({0, 0, end * height}, n, {0, 0});
    for (int i = 0; i < segments; ++i) {
      const Vector2d c = OnCircle(i, segments);
      b.Add({r * c.x(), r * c.y(), end * height}, n, {r * c.x(), r * c.y()});
    }
    for (int i = 0; i < segments; ++i) {
      const std::int32_t p = centre + 1 + i, q = centre + 1 + (i + 1) % segments;
      if (end == 0)
        b.Face(centre, q, p);
      else
        b.Face(centre, p, q);
    }
  }
  return b;
}

Builder Heightfield(const ObjectDescription& object) {
  Builder b;
  const int n = std::max(2, object.segments);
  const auto height = [&](double x, double y) {
    const Eigen::Vector3f p(static_cast<float>(x / object.wavelength), static_cast<float>(y / object.wavelength),
                            0.37f);
    return object.size.z() * static_cast<double>(FractalNoise(p, 4, 0.45f, 0.0f, 17));
  };
  const double step = 1e-3 * object.wavelength;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const double x = object.size.x() * (static_cast<double>(i) / n - 0.5);
      const double y = object.size.y() * (static_cast<double>(j) / n - 0.5);
      const Vector3d normal((height(x - step, y) - height(x + step, y)) / (2 * step),
                            (height(x, y - step) - height(x, y + step)) / (2 * step), 1);
      b.Add({x, y, height(x, y)}, normal.normalized(), {x + 0.5 * object.size.x(), y + 0.5 * object.size.y()});
    }
  GridFaces(b, 0, n, n);
  return b;
}

// Through cross-sections (superellipses), smooth between them (Catmull and Rom 1974), flat at the ends.
Builder Loft(const ObjectDescription& object) {
  const auto& sections = object.sections;
  const Vector3d along = (sections.back().centre - sections.front().centre).normalized();
  const Vector3d across = object.loft_up.cross(along).normalized();
  const Vector3d up = along.cross(across);
  const int last = static_cast<int>(sections.size()) - 1;
  const int steps = std::max(4, object.segments / 8);  // rings between two sections
  const auto at = [&](int i) -> const LoftSection& {
    return sections[static_cast<std::size_t>(std::clamp(i, 0, last))];
  };
  const auto curve = [](const auto& a, const auto& b, const auto& c, const auto& d, double t) {
    return (0.5 * (2 * b + t * (c - a) + t * t * (2 * a - 5 * b + 4 * c - d) + t * t * t * (3 * b - a - 3 * c + d)))
        .eval();
  };
  // One width of texture all along: its lines run straight over thick and thin.
  double width = 0;
  for (const LoftSection& section : sections)
    width += kPi * section.half_size.sum() / static_cast<double>(sections.size());
  Builder b;
  const int rings = last * steps;
  const int columns = object.segments;
  for (int ring = 0; ring <= rings; ++ring) {
    const int i = std::min(ring / steps, last - 1);
    const double t = static_cast<double>(ring - i * steps) / steps;
    const Vector3d centre = curve(at(i - 1).centre, at(i).centre, at(i + 1).centre, at(i + 2).centre, t);
    const Vector2d half =
        curve(at(i - 1).half_size, at(i).half_size, at(i + 1).half_size, at(i + 2).half_size, t).cwiseMax(1e-6);
    for (int k = 0; k <= columns; ++k) {
      const Vector2d c = OnCircle(k, columns);
      const auto rounded = [&](double value) {
        return std::copysign(std::pow(std::abs(value), 2 / object.squareness), value);
      };
      const Vector3d x = centre + across * (half.x() * rounded(c.x())) + up * (half.y() * rounded(c.y()));
      b.Add(x, Vector3d::Zero(), {width * k / columns, along.dot(centre)});
    }
  }
  GridFaces(b, 0, columns, rings);
  // Normals from the faces around each vertex; the seam's two copies get the same.
  const std::int32_t stride = columns + 1;
  for (const auto& f : b.faces) {
    const Vector3d area = (b.x[static_cast<std::size_t>(f[1])] - b.x[static_cast<std::size_t>(f[0])])
                              .cross(b.x[static_cast<std::size_t>(f[2])] - b.x[static_cast<std::size_t>(f[0])]);
    for (const std::int32_t v : f) b.n[static_cast<std::size_t>(v)] += area;
  }
  for (int ring = 0; ring <= rings; ++ring) {
    const auto first = static_cast<std::size_t>(ring * stride), end = first + static_cast<std::size_t>(columns);
    const Vector3d sum = b.n[first] + b.n[end];
    b.n[first] = b.n[end] = sum;
  }
  for (Vector3d& n : b.n) n = n.norm() > 0 ? Vector3d(n.normalized()) : along;
  // Ends.
  for (int end = 0; end <= 1; ++end) {
    const std::int32_t ring = end == 0 ? 0 : rings * stride;
    const Vector3d n = end == 0 ? Vector3d(-along) : along;
    const std::int32_t centre = b.Add(sections[end == 0 ? 0 : static_cast<std::size_t>(last)].centre, n, {0, 0});
    for (int k = 0; k < columns; ++k) {
      const Vector3d x = b.x[static_cast<std::size_t>(ring + k)];
      b.Add(x, n, {across.dot(x), up.dot(x)});
    }
    for (int k = 0; k < columns; ++k) {
      const std::int32_t p = centre + 1 + k, q = centre + 1 + (k + 1) % columns;
      if (end == 0)
        b.Face(centre, q, p);
      else
        b.Face(centre, p, q);
    }
  }
  return b;
}

// A mesh has no texture coordinates: those of the plane that each face is nearest to. Flat shading.
Builder FromFile(const std::filesystem::path& file) {
  const Mesh mesh = ReadMesh(file);
  if (const auto wrong = Validate(mesh)) throw InputError(file, *wrong);
  if (mesh.faces.empty()) throw InputError(file, "has no faces");
  Builder b;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const Vector3d n = mesh.FaceNormal(f);
    Eigen::Index axis = 0;
    n.cwiseAbs().maxCoeff(&axis);
    std::int32_t v[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d& x = mesh.vertices[static_cast<std::size_t>(mesh.faces[f][k])];
      const Vector2d uv =
          axis == 0 ? Vector2d(x.y(), x.z()) : (axis == 1 ? Vector2d(x.x(), x.z()) : Vector2d(x.x(), x.y()));
      v[k] = b.Add(x, n, uv);
    }
    b.Face(v[0], v[1], v[2]);
  }
  return b;
}

Builder Build(const ObjectDescription& object) {
  switch (object.kind) {
    case ShapeKind::kQuad: {
      Builder b;
      b.Rectangle(Vector3d::Zero(), Vector3d::UnitX() * 0.5 * object.size.x(),
                  Vector3d::UnitY() * 0.5 * object.size.y());
      return b;
    }
    case ShapeKind::kBox: return Box(object.size);
    case ShapeKind::kSphere: return Sphere(object.radius, object.segments);
    case ShapeKind::kCylinder: return Cylinder(object.radius, object.top_radius, object.height, object.segments);
    case ShapeKind::kTube: return Tube(object.size);
    case ShapeKind::kHeightfield: return Heightfield(object);
    case ShapeKind::kLoft: return Loft(object);
    case ShapeKind::kMesh: return FromFile(object.file);
  }
  throw std::logic_error("shape kind");
}

}  // namespace

ShapeMesh Tessellate(const ObjectDescription& object) {
  const Builder b = Build(object);
  ShapeMesh shape;
  const Eigen::Matrix3d linear = object.world_from_object.linear();
  const Eigen::Matrix3d normal_matrix = linear.inverse().transpose();
  const Vector3d scale = linear.colwise().norm();
  const double mean_scale = std::cbrt(scale.prod());
  for (std::size_t i = 0; i < b.x.size(); ++i) {
    shape.x_in_object.push_back(scale.cwiseProduct(b.x[i]));
    const Eigen::Vector3f rounded = (object.world_from_object * b.x[i]).cast<float>();
    shape.x_in_world.push_back(rounded.cast<double>());
    shape.normals.push_back((normal_matrix * b.n[i]).normalized());
    shape.uv.push_back((mean_scale * b.uv[i]).cast<float>());
  }
  for (std::size_t f = 0; f < b.faces.size(); ++f) {
    const auto& face = b.faces[f];
    const Vector3d& p = shape.x_in_world[static_cast<std::size_t>(face[0])];
    const Vector3d& q = shape.x_in_world[static_cast<std::size_t>(face[1])];
    const Vector3d& r = shape.x_in_world[static_cast<std::size_t>(face[2])];
    if (!((q - p).cross(r - p).norm() > 0)) continue;  // at the poles
    shape.faces.push_back(face);
    shape.part.push_back(b.part[f]);
  }
  return shape;
}

Mesh Welded(const ShapeMesh& shape) {
  Mesh mesh;
  std::map<std::tuple<double, double, double>, std::int32_t> seen;
  std::vector<std::int32_t> to(shape.x_in_world.size());
  for (std::size_t i = 0; i < to.size(); ++i) {
    const Vector3d& x = shape.x_in_world[i];
    const auto [it, added] = seen.try_emplace({x.x(), x.y(), x.z()}, static_cast<std::int32_t>(mesh.vertices.size()));
    if (added) mesh.vertices.push_back(x);
    to[i] = it->second;
  }
  for (const auto& f : shape.faces) {
    const std::array<std::int32_t, 3> welded = {to[static_cast<std::size_t>(f[0])], to[static_cast<std::size_t>(f[1])],
                                                to[static_cast<std::size_t>(f[2])]};
    if (welded[0] == welded[1] || welded[1] == welded[2] || welded[2] == welded[0]) continue;
    mesh.faces.push_back(welded);
  }
  return mesh;
}

}  // namespace lumi
