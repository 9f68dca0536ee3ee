#include "scene/files/mesh_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstring>
#include <limits>

#include "scene/files/atomic_file.h"
#include "scene/files/byte_cursor.h"
#include "scene/files/file_name.h"
#include "scene/files/open_to_read.h"
#include "scene/files/text_scan.h"
#include "scene/program/error.h"
#include "scene/program/memory.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

using text_scan::NextLine;
using text_scan::NextWord;
using text_scan::ToNumber;
using text_scan::Trim;

constexpr std::size_t kMaxMeshBytes = std::size_t(1) << 34;
constexpr std::size_t kLargeMeshBytes = std::size_t(1) << 26;  // larger files: free memory is checked first
constexpr std::size_t kMaxHeaderLines = 4096;
constexpr std::size_t kMaxIndex = std::numeric_limits<std::int32_t>::max();

bool IsPly(std::string_view file) { return file.starts_with("ply\n") || file.starts_with("ply\r"); }

std::string Quoted(std::string_view text) { return fmt::format("\"{}\"", text.substr(0, 40)); }

// --- PLY (Turk 1994). --------------------------------------------------------------------------------------------

enum class Scalar { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

std::optional<Scalar> ScalarFromName(std::string_view n) {
  if (n == "char" || n == "int8") return Scalar::kInt8;
  if (n == "uchar" || n == "uint8") return Scalar::kUint8;
  if (n == "short" || n == "int16") return Scalar::kInt16;
  if (n == "ushort" || n == "uint16") return Scalar::kUint16;
  if (n == "int" || n == "int32") return Scalar::kInt32;
  if (n == "uint" || n == "uint32") return Scalar::kUint32;
  if (n == "float" || n == "float32") return Scalar::kFloat;
  if (n == "double" || n == "float64") return Scalar::kDouble;
  return std::nullopt;
}

std::size_t SizeOf(Scalar s) {
  constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(s)];
}

enum class Role { kOther, kX, kY, kZ, kRed, kGreen, kBlue, kIndices };

struct Property {
  Scalar type = Scalar::kFloat;
  std::optional<Scalar> count_type;  // a list
  Role role = Role::kOther;
};
struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};
struct PlyHeader {
  enum class Format { kAscii, kLittle, kBig } format = Format::kAscii;
  std::vector<Element> elements;
};

Role RoleOf(const std::string& element, std::string_view name, bool list) {
  if (element == "vertex" && !list) {
    if (name == "x") return Role::kX;
    if (name == "y") return Role::kY;
    if (name == "z") return Role::kZ;
    if (name == "red" || name == "diffuse_red" || name == "r") return Role::kRed;
    if (name == "green" || name == "diffuse_green" || name == "g") return Role::kGreen;
    if (name == "blue" || name == "diffuse_blue" || name == "b") return Role::kBlue;
  }
  if (element == "face" && list && (name == "vertex_indices" || name == "vertex_index")) return Role::kIndices;
  return Role::kOther;
}

PlyHeader ReadPlyHeader(const fs::path& path, std::string_view& text) {
  PlyHeader header;
  std::string_view line;
  bool have_format = false;
  NextLine(text, line);  // "ply", seen by the caller
  for (std::size_t n = 2; n < kMaxHeaderLines; ++n) {
    if (!NextLine(text, line)) break;
    const auto fail = [&](const std::string& what) {
      return InputError(path, fmt::format("line {} of the header: {}", n, what));
    };
    std::string_view rest = Trim(line);
    const std::string_view word = NextWord(rest);
    if (word.empty() || word == "comment" || word == "obj_info") continue;
    if (word == "end_header") {
      if (!have_format) throw fail("no format was given");
      return header;
    }
    if (word == "format") {
      const std::string_view format = NextWord(rest);
      if (format == "ascii")
        header.format = PlyHeader::Format::kAscii;
      else if (format == "binary_little_endian")
        header.format = PlyHeader::Format::kLittle;
      else if (format == "binary_big_endian")
        header.format = PlyHeader::Format::kBig;
      else
        throw fail("unknown format " + Quoted(format));
      have_format = true;
    } else if (word == "element") {
      Element element;
      element.name = NextWord(rest);
      const auto count = ToNumber<std::uint64_t>(NextWord(rest));
      if (!count) throw fail("the count of element " + Quoted(element.name) + " is no number");
      element.count = static_cast<std::size_t>(*count);
      for (const Element& other : header.elements)
        if (other.name == element.name) throw fail("element " + Quoted(element.name) + " comes twice");
      header.elements.push_back(std::move(element));
    } else if (word == "property") {
      if (header.elements.empty()) throw fail("a property before any element");
      Element& element = header.elements.back();
      Property property;
      std::string_view type = NextWord(rest);
      if (type == "list") {
        property.count_type = ScalarFromName(NextWord(rest));
        if (!property.count_type || *property.count_type >= Scalar::kFloat)
          throw fail("a list whose length is no integer type");
        type = NextWord(rest);
      }
      const auto scalar = ScalarFromName(type);
      if (!scalar) throw fail("unknown type " + Quoted(type));
      property.type = *scalar;
      property.role = RoleOf(element.name, NextWord(rest), property.count_type.has_value());
      if (property.role == Role::kIndices && *scalar >= Scalar::kFloat) throw fail("vertex indices are no integers");
      element.properties.push_back(property);
    } else {
      throw fail("unknown word " + Quoted(word));
    }
  }
  throw InputError(path, "the PLY header has no end");
}

// Both sources of values answer as double: exact for all of PLY's types.
class BinaryValues {
 public:
  BinaryValues(std::string_view bytes, const fs::path& path, bool swap) : cursor_(bytes, path, swap) {}
  double Next(Scalar type) {
    switch (type) {
      case Scalar::kInt8: return cursor_.Read<std::int8_t>("mesh data");
      case Scalar::kUint8: return cursor_.Read<std::uint8_t>("mesh data");
      case Scalar::kInt16: return cursor_.Read<std::int16_t>("mesh data");
      case Scalar::kUint16: return cursor_.Read<std::uint16_t>("mesh data");
      case Scalar::kInt32: return cursor_.Read<std::int32_t>("mesh data");
      case Scalar::kUint32: return cursor_.Read<std::uint32_t>("mesh data");
      case Scalar::kFloat: return static_cast<double>(cursor_.Read<float>("mesh data"));
      case Scalar::kDouble: return cursor_.Read<double>("mesh data");
    }
    throw std::logic_error("unknown scalar type");
  }
  void Require(std::uint64_t count, std::size_t bytes_each, const std::string& what) {
    cursor_.Require(count, bytes_each, what.c_str());
  }
  static std::size_t BytesOf(Scalar type) { return SizeOf(type); }

 private:
  ByteCursor cursor_;
};

class TextValues {
 public:
  TextValues(std::string_view text, const fs::path& path) : cursor_(text), path_(path) {}
  double Next(Scalar) {
    const std::string_view word = NextWord(cursor_);
    if (word.empty())
      throw InputError(path_, "ends in the middle of the mesh: the file is cut off or its counts are wrong");
    const auto value = ToNumber<double>(word);
    if (!value) throw InputError(path_, Quoted(word) + " is no number");
    return *value;
  }
  void Require(std::uint64_t count, std::size_t bytes_each, const std::string& what) {
    if (count > (cursor_.size() + 1) / bytes_each)
      throw InputError(
          path_,
          fmt::format("{}: {} of them do not fit into the {} bytes that are left: the file is cut off or corrupt", what,
                      count, cursor_.size()));
  }
  static std::size_t BytesOf(Scalar) { return 2; }  // a digit and a blank

 private:
  std::string_view cursor_;
  const fs::path& path_;
};

std::uint8_t ColorCode(double value, Scalar type) {
  if (type == Scalar::kFloat || type == Scalar::kDouble) value *= 255.0;
  if (type == Scalar::kUint16) value /= 257.0;
  return !(value > 0) ? std::uint8_t{0} : static_cast<std::uint8_t>(std::min(value, 255.0) + 0.5);
}

void AddFan(Mesh& mesh, const std::vector<std::int32_t>& polygon) {
  for (std::size_t i = 2; i < polygon.size(); ++i) mesh.faces.push_back({polygon[0], polygon[i - 1], polygon[i]});
}

template <typename Values>
void ReadVertices(const Element& element, Values& values, Mesh& mesh) {
  bool colored = false;
  for (const Property& p : element.properties) colored |= p.role == Role::kRed;
  mesh.vertices.reserve(element.count);
  if (colored) mesh.colors.reserve(element.count);
  for (std::size_t i = 0; i < element.count; ++i) {
    Eigen::Vector3d x = Eigen::Vector3d::Zero();
    std::array<std::uint8_t, 3> color{};
    for (const Property& p : element.properties) {
      if (p.count_type) {
        const double n = values.Next(*p.count_type);
        for (double k = 0; k < n; ++k) values.Next(p.type);
        continue;
      }
      const double v = values.Next(p.type);
      switch (p.role) {
        case Role::kX: x.x() = v; break;
        case Role::kY: x.y() = v; break;
        case Role::kZ: x.z() = v; break;
        case Role::kRed: color[0] = ColorCode(v, p.type); break;
        case Role::kGreen: color[1] = ColorCode(v, p.type); break;
        case Role::kBlue: color[2] = ColorCode(v, p.type); break;
        default: break;
      }
    }
    mesh.vertices.push_back(x);
    if (colored) mesh.colors.push_back(color);
  }
}

template <typename Values>
void ReadFaces(const fs::path& path, const Element& element, Values& values, std::size_t vertices, Mesh& mesh) {
  mesh.faces.reserve(element.count);
  std::vector<std::int32_t> polygon;
  for (std::size_t i = 0; i < element.count; ++i)
    for (const Property& p : element.properties) {
      const double length = p.count_type ? values.Next(*p.count_type) : 1.0;
      if (!(length >= 0)) throw InputError(path, fmt::format("face {} has a list of negative length", i));
      if (length > 0)
        values.Require(static_cast<std::uint64_t>(std::min(length, 1e18)), Values::BytesOf(p.type),
                       fmt::format("corners of face {}", i));
      if (p.role != Role::kIndices) {
        for (double k = 0; k < length; ++k) values.Next(p.type);
        continue;
      }
      if (length < 3) throw InputError(path, fmt::format("face {} has {} corners", i, length));
      polygon.clear();
      for (double k = 0; k < length; ++k) {
        const double index = values.Next(p.type);
        if (!(index >= 0 && index < static_cast<double>(vertices)) || index != std::floor(index))
          throw InputError(path, fmt::format("face {} names vertex {} of {}", i, index, vertices));
        polygon.push_back(static_cast<std::int32_t>(index));
      }
      AddFan(mesh, polygon);
    }
}

template <typename Values>
Mesh ReadPlyBody(const fs::path& path, const PlyHeader& header, Values values) {
  Mesh mesh;
  const Element* vertex = nullptr;
  const Element* face = nullptr;
  for (const Element& e : header.elements) {
    if (e.name == "vertex") vertex = &e;
    if (e.name == "face") face = &e;
  }
  const auto has = [](const Element& e, Role role) {
    return std::count_if(e.properties.begin(), e.properties.end(), [&](const Property& p) { return p.role == role; });
  };
  if (!vertex || has(*vertex, Role::kX) != 1 || has(*vertex, Role::kY) != 1 || has(*vertex, Role::kZ) != 1)
    throw InputError(path, "has no vertices with x, y and z");
  if (const auto reds = has(*vertex, Role::kRed);
      reds > 1 || has(*vertex, Role::kGreen) != reds || has(*vertex, Role::kBlue) != reds)
    throw InputError(path, "has colours without all of red, green and blue");
  if (vertex->count > kMaxIndex)
    throw InputError(path, fmt::format("{} vertices are more than can be held", vertex->count));
  if (!face || face->count == 0) throw InputError(path, "has no faces: it is a point cloud, not a mesh");
  if (has(*face, Role::kIndices) != 1)
    throw InputError(path, "has faces without vertex_indices",
                     "triangle strips are not read: save the mesh with plain faces");
  for (const Element& e : header.elements) {
    if (e.properties.empty()) continue;  // takes no bytes, whatever its count
    std::size_t bytes = 0;
    for (const Property& p : e.properties) bytes += Values::BytesOf(p.count_type.value_or(p.type));
    values.Require(e.count, bytes, "element " + Quoted(e.name));
    if (&e == vertex) {
      ReadVertices(e, values, mesh);
    } else if (&e == face) {
      ReadFaces(path, e, values, vertex->count, mesh);
    } else {
      for (std::size_t i = 0; i < e.count; ++i)
        for (const Property& p : e.properties) {
          const double length = p.count_type ? values.Next(*p.count_type) : 1.0;
          for (double k = 0; k < length; ++k) values.Next(p.type);
        }
    }
  }
  return mesh;
}

Mesh ReadPly(const fs::path& path, const std::string& file) {
  std::string_view body = file;
  const PlyHeader header = ReadPlyHeader(path, body);
  if (header.format == PlyHeader::Format::kAscii) return ReadPlyBody(path, header, TextValues(body, path));
  const bool file_is_big = header.format == PlyHeader::Format::kBig;
  return ReadPlyBody(path, header, BinaryValues(body, path, file_is_big != (std::endian::native == std::endian::big)));
}

// --- OBJ. --------------------------------------------------------------------------------------------------------

Mesh ReadObj(const fs::path& path, std::string_view text) {
  Mesh mesh;
  std::vector<std::int32_t> polygon;
  std::string joined;
  std::string_view line;
  for (std::size_t number = 1; NextLine(text, line); ++number) {
    const auto fail = [&](const std::string& what) {
      return InputError(path, fmt::format("line {}: {}", number, what));
    };
    std::string_view rest = Trim(line);
    if (!rest.empty() && rest.back() == '\\') {  // goes on in the next line
      joined.assign(rest.substr(0, rest.size() - 1));
      while (NextLine(text, line)) {
        ++number;
        rest = Trim(line);
        const bool more = !rest.empty() && rest.back() == '\\';
        joined.append(" ").append(more ? rest.substr(0, rest.size() - 1) : rest);
        if (!more) break;
      }
      rest = joined;
    }
    const std::string_view word = NextWord(rest);
    if (word == "v") {
      Eigen::Vector3d x;
      for (int k = 0; k < 3; ++k) {
        const auto value = text_scan::NextNumber<double>(rest);
        if (!value) throw fail("a vertex without three numbers");
        x[k] = *value;
      }
      // "v x y z r g b" (MeshLab) carries colours as 0..1.
      std::array<double, 3> rgb{};
      std::size_t extra = 0;
      while (extra < 3) {
        const auto value = text_scan::NextNumber<double>(rest);
        if (!value) break;
        rgb[extra++] = *value;
      }
      if (extra == 3 && mesh.colors.size() == mesh.vertices.size())
        mesh.colors.push_back({ColorCode(rgb[0], Scalar::kDouble), ColorCode(rgb[1], Scalar::kDouble),
                               ColorCode(rgb[2], Scalar::kDouble)});
      mesh.vertices.push_back(x);
      if (mesh.vertices.size() > kMaxIndex) throw fail("more vertices than can be held");
    } else if (word == "f") {
      polygon.clear();
      for (std::string_view corner = NextWord(rest); !corner.empty(); corner = NextWord(rest)) {
        const auto index = ToNumber<std::int64_t>(corner.substr(0, corner.find('/')));
        if (!index) throw fail(Quoted(corner) + " is no vertex");
        const auto count = static_cast<std::int64_t>(mesh.vertices.size());
        // Counted from 1, or backwards from the last vertex so far. Positive ones may lie ahead: checked at the end.
        const std::int64_t zero_based = *index < 0 ? count + *index : *index - 1;
        if (*index == 0 || zero_based < 0 || zero_based >= static_cast<std::int64_t>(kMaxIndex))
          throw fail(fmt::format("names vertex {} of {}", *index, count));
        polygon.push_back(static_cast<std::int32_t>(zero_based));
      }
      if (polygon.size() < 3) throw fail(fmt::format("a face with {} corners", polygon.size()));
      AddFan(mesh, polygon);
    }
  }
  if (mesh.colors.size() != mesh.vertices.size()) mesh.colors.clear();
  if (mesh.vertices.empty()) throw InputError(path, "has no vertices: is it an OBJ mesh?");
  if (mesh.faces.empty()) throw InputError(path, "has no faces: it is a point cloud, not a mesh");
  return mesh;
}

std::string ToPly(const Mesh& mesh) {
  const bool colored = !mesh.colors.empty();
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double "
      "z\n{}"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.vertices.size(), colored ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "",
      mesh.faces.size());
  bytes.reserve(bytes.size() + mesh.vertices.size() * 27 + mesh.faces.size() * 13);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (int k = 0; k < 3; ++k) AppendLittleEndian(bytes, mesh.vertices[i][k]);
    if (colored)
      for (const std::uint8_t c : mesh.colors[i]) AppendLittleEndian(bytes, c);
  }
  for (const auto& face : mesh.faces) {
    AppendLittleEndian(bytes, std::uint8_t{3});
    for (const std::int32_t v : face) AppendLittleEndian(bytes, v);
  }
  return bytes;
}

std::string ToObj(const Mesh& mesh) {
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d& x = mesh.vertices[i];
    fmt::format_to(out, "v {} {} {}", x.x(), x.y(), x.z());
    if (!mesh.colors.empty())
      for (const std::uint8_t c : mesh.colors[i]) fmt::format_to(out, " {}", c / 255.0);
    fmt::format_to(out, "\n");
  }
  for (const auto& f : mesh.faces) fmt::format_to(out, "f {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1);
  return fmt::to_string(text);
}

}  // namespace

// Bytes that reading takes and then the work with the mesh: of a PLY by its counts (polygons of four corners on
// average), of an OBJ by its length.
static std::uint64_t MemoryFor(const fs::path& path, std::uint64_t file_bytes, std::size_t work_bytes_per_face) {
  constexpr std::uint64_t kVertex = sizeof(Eigen::Vector3d) + 3, kFace = 2 * 3 * sizeof(std::int32_t);
  constexpr std::uint64_t kBytesOfObjFace = 40;  // of the file, with its share of the vertices
  constexpr std::size_t kHead = 1 << 16;
  std::string head(kHead, '\0');
  std::ifstream in = OpenToRead(path);
  in.read(head.data(), kHead);
  head.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, in.gcount())));
  std::uint64_t mesh_bytes = 3 * file_bytes, faces = file_bytes / kBytesOfObjFace;
  if (IsPly(head)) {
    mesh_bytes = 0;
    std::string_view text = head;
    for (const Element& e : ReadPlyHeader(path, text).elements) {
      // More than the file can hold are refused later. A face has a length and three corners.
      const std::uint64_t count = std::min<std::uint64_t>(e.count, file_bytes / 3);
      if (e.name == "face") faces = count;
      mesh_bytes += count * (e.name == "vertex" ? kVertex : e.name == "face" ? kFace : 0);
    }
  }
  return std::max(file_bytes + mesh_bytes, mesh_bytes + faces * work_bytes_per_face);
}

Mesh ReadMeshWithFlaws(const fs::path& path, std::size_t work_bytes_per_face) {
  std::error_code error;
  if (const auto bytes = fs::file_size(path, error); !error && bytes > kLargeMeshBytes && bytes <= kMaxMeshBytes)
    RequireMemory(MemoryFor(path, bytes, work_bytes_per_face), path,
                  "simplify the mesh where it was made, or use a larger machine");
  Mesh mesh = [&] {
    const std::string file = ReadText(path, kMaxMeshBytes);
    const bool ply = IsPly(file);
    if (!ply && LowerExtension(path) == ".ply") throw InputError(path, "is no PLY file");
    if (!ply && LowerExtension(path) != ".obj") throw InputError(path, "is neither a PLY nor an OBJ mesh");
    return ply ? ReadPly(path, file) : ReadObj(path, file);
  }();
  // OBJ may name vertices that come later, or never.
  Mesh finite = {std::vector<Eigen::Vector3d>(mesh.vertices.size(), Eigen::Vector3d::Zero()), std::move(mesh.faces),
                 std::move(mesh.colors)};
  if (const auto wrong = Validate(finite)) throw InputError(path, *wrong);
  finite.vertices = std::move(mesh.vertices);
  return finite;
}

Mesh ReadMesh(const fs::path& path, std::size_t work_bytes_per_face) {
  Mesh mesh = ReadMeshWithFlaws(path, work_bytes_per_face);
  if (const auto wrong = Validate(mesh)) throw InputError(path, *wrong);
  return mesh;
}

void WriteMesh(const fs::path& path, const Mesh& mesh) {
  if (const auto wrong = Validate(mesh)) throw std::invalid_argument("WriteMesh: " + *wrong);
  const std::string extension = LowerExtension(path);
  if (extension != ".ply" && extension != ".obj")
    throw UsageError(fmt::format("{}: meshes are written as .ply or .obj", path.string()));
  WriteTextAtomically(path, extension == ".ply" ? ToPly(mesh) : ToObj(mesh));
}

}  // namespace lumi
