#include "tests/proxy/photographed_planes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/files/image_io.h"
#include "scene/program/parallel_each.h"

namespace lumi::test {
namespace {

double Hash(int x, int y, std::uint32_t seed) {
  std::uint32_t h =
      static_cast<std::uint32_t>(x) * 0x8da6b343U + static_cast<std::uint32_t>(y) * 0xd8163841U + seed * 0xcb1ab31fU;
  h = (h ^ (h >> 15)) * 0x2c1b3c6dU;
  h = (h ^ (h >> 12)) * 0x297a2d39U;
  return static_cast<double>(h ^ (h >> 15)) / 4294967296.0;
}

struct Hit {
  double depth = std::numeric_limits<double>::infinity(), grey = 0;
};

Hit Trace(const std::vector<TexturedPlane>& world, const StereoCamera& camera, double x, double y) {
  const Eigen::Vector3d eye = camera.cam_from_world.OriginInSource();
  const Eigen::Vector3d d = camera.cam_from_world.rotation.conjugate() * camera.Ray(x, y);  // depth 1
  Hit hit;
  for (const TexturedPlane& plane : world) {
    const Eigen::Vector3d n = plane.a.cross(plane.b);
    const double depth = n.dot(plane.middle - eye) / n.dot(d);
    if (!(depth > 0) || depth >= hit.depth) continue;
    const Eigen::Vector3d off = eye + depth * d - plane.middle;
    const double s = off.dot(plane.a) / plane.a.squaredNorm(), t = off.dot(plane.b) / plane.b.squaredNorm();
    if (std::abs(s) > 1 || std::abs(t) > 1) continue;
    hit = {depth, plane.grey(s * plane.a.norm(), t * plane.b.norm())};
  }
  return hit;
}

}  // namespace

std::function<double(double, double)> NoiseTexture(double grain, std::uint32_t seed) {
  return [=](double s, double t) {
    double sum = 0, weights = 0;
    for (int octave = 0; octave < 4; ++octave) {
      const double size = grain * (1 << octave), weight = 1 + 0.5 * octave;
      const double x = s / size, y = t / size;
      const double fx = std::floor(x), fy = std::floor(y);
      const auto smooth = [](double f) { return f * f * (3 - 2 * f); };
      const double a = smooth(x - fx), b = smooth(y - fy);
      const int i = static_cast<int>(fx), j = static_cast<int>(fy);
      const std::uint32_t layer = seed * 16 + static_cast<std::uint32_t>(octave);
      const double value = (1 - b) * ((1 - a) * Hash(i, j, layer) + a * Hash(i + 1, j, layer)) +
                           b * ((1 - a) * Hash(i, j + 1, layer) + a * Hash(i + 1, j + 1, layer));
      sum += weight * value;
      weights += weight;
    }
    return std::clamp(128 + 2.2 * 255 * (sum / weights - 0.5), 20.0, 235.0);
  };
}

Photographed Photograph(const std::vector<TexturedPlane>& world, const StereoCamera& camera, double gain,
                        double offset) {
  Photographed photo;
  photo.picture.camera = camera;
  photo.picture.grey = Image8(camera.width, camera.height, 1);
  photo.depth.assign(photo.picture.grey.data.size(), 0);
  ParallelEach(static_cast<std::size_t>(camera.height), 1, [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < camera.width; ++x) {
      double grey = 0;
      for (const double dx : {0.25, 0.75})
        for (const double dy : {0.25, 0.75}) grey += 0.25 * Trace(world, camera, x + dx, y + dy).grey;
      const std::size_t p = row * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(x);
      const double depth = Trace(world, camera, x + 0.5, y + 0.5).depth;
      photo.depth[p] = std::isfinite(depth) ? depth : 0;
      photo.picture.grey.data[p] = static_cast<std::uint8_t>(std::clamp(std::lround(gain * grey + offset), 0L, 255L));
    }
  });
  return photo;
}

StereoCamera CameraAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, int width, int height) {
  StereoCamera camera;
  camera.width = width;
  camera.height = height;
  camera.focal_px = Eigen::Vector2d::Constant(1.2 * width);
  camera.centre_px = {0.5 * width, 0.5 * height};
  camera.cam_from_world = LookAt(eye, target, {0, -1, 0});
  return camera;
}

Scene SceneOf(const std::vector<TexturedPlane>& world, const std::vector<StereoCamera>& cameras,
              const std::filesystem::path& folder) {
  Scene scene;
  scene.image_folder = folder;
  std::vector<Photographed> photos;
  for (std::size_t v = 0; v < cameras.size(); ++v) {
    const StereoCamera& c = cameras[v];
    photos.push_back(Photograph(world, c));
    View view;
    view.name = "photo" + std::to_string(10 + v) + ".png";
    view.camera = CameraId{static_cast<std::int32_t>(v)};
    view.cam_from_world = c.cam_from_world;
    scene.cameras.push_back(
        Camera::Pinhole(c.width, c.height, c.focal_px.x(), c.focal_px.y(), c.centre_px.x(), c.centre_px.y()));
    scene.views.push_back(view);
    Image8 rgb(c.width, c.height, 3);
    for (std::size_t p = 0; p < photos[v].picture.grey.data.size(); ++p)
      for (std::size_t k = 0; k < 3; ++k) rgb.data[3 * p + k] = photos[v].picture.grey.data[p];
    WriteImage(folder / view.name, rgb);
  }
  // Every twelfth pixel of each photo is a point, with those photos in whose depth it is right.
  for (std::size_t v = 0; v < cameras.size(); ++v) {
    for (int y = 6; y < cameras[v].height; y += 12) {
      for (int x = 6; x < cameras[v].width; x += 12) {
        const double depth = photos[v].depth[static_cast<std::size_t>(y * cameras[v].width + x)];
        if (!(depth > 0)) continue;
        Point point;
        point.x_in_world = cameras[v].InWorld(x + 0.5, y + 0.5, depth);
        point.error_px = 0.3;
        for (std::size_t o = 0; o < cameras.size(); ++o) {
          const Eigen::Vector3d in_cam = cameras[o].cam_from_world * point.x_in_world;
          if (!(in_cam.z() > 0)) continue;
          const Eigen::Vector2d px =
              in_cam.head<2>().cwiseProduct(cameras[o].focal_px) / in_cam.z() + cameras[o].centre_px;
          const int i = static_cast<int>(std::floor(px.x())), j = static_cast<int>(std::floor(px.y()));
          if (i < 0 || j < 0 || i >= cameras[o].width || j >= cameras[o].height) continue;
          const double there = photos[o].depth[static_cast<std::size_t>(j * cameras[o].width + i)];
          if (std::abs(there - in_cam.z()) < 0.05 * in_cam.z())
            point.track.push_back({ViewId{static_cast<std::int32_t>(o)}, px});
        }
        if (point.track.size() >= 2) scene.points.push_back(point);
      }
    }
  }
  UpdateFrameOfReference(scene);
  return scene;
}

std::vector<DepthMap> MatchAll(const std::vector<Photographed>& photos, double start_depth, double nearest,
                               double farthest) {
  std::vector<DepthMap> maps;
  for (const Photographed& photo : photos) {
    maps.emplace_back(photo.picture.camera.width, photo.picture.camera.height);
    std::ranges::fill(maps.back().w, static_cast<float>(1 / start_depth));
  }
  for (int round = 0; round < 3; ++round) {
    std::vector<DepthMap> next = maps;
    for (std::size_t v = 0; v < photos.size(); ++v) {
      std::vector<MatchSource> sources;
      for (std::size_t o = 0; o < photos.size(); ++o)
        if (o != v) sources.push_back({&photos[o].picture, round > 0 ? &maps[o] : nullptr});
      PatchMatchOptions options;
      options.iterations = round == 0 ? 6 : 2;
      options.seed = static_cast<std::uint32_t>(100 * round) + static_cast<std::uint32_t>(v);
      options.nearest_w = static_cast<float>(1 / nearest);
      options.farthest_w = static_cast<float>(1 / farthest);
      options.perturbation /= static_cast<float>(1 << round);
      MatchPatches(photos[v].picture, sources, options, next[v]);
    }
    maps = std::move(next);
  }
  return maps;
}

double ShareWithin(const DepthMap& map, const Photographed& photo, double tolerance) {
  std::size_t pixels = 0, good = 0;
  for (std::size_t p = 0; p < photo.depth.size(); ++p) {
    if (!(photo.depth[p] > 0)) continue;
    ++pixels;
    good += std::abs(map.w[p] * photo.depth[p] - 1) <= tolerance;
  }
  return static_cast<double>(good) / static_cast<double>(pixels);
}

TexturedPlane Wall(double depth, std::uint32_t seed) {
  return {{0, 0, depth}, {6, 0, 0}, {0, 4.5, 0}, NoiseTexture(0.05, seed)};
}

std::vector<StereoCamera> RowOfCameras(int count, double step, double depth) {
  std::vector<StereoCamera> cameras;
  for (int i = 0; i < count; ++i) {
    const double x = step * (i - 0.5 * (count - 1));
    cameras.push_back(CameraAt({x, 0.1 * (i % 2), 0}, {0.3 * x, 0, depth}));
  }
  return cameras;
}

}  // namespace lumi::test
