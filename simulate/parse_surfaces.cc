// Textures, materials and objects.
#include <charconv>
#include <cmath>

#include "scene/geometry/angle.h"
#include "simulate/parse_parts.h"
#include "simulate/photo_response.h"

namespace lumi {
namespace {

using Range = JsonReader::Range;

Rgb ColorFromJson(const nlohmann::json& value, const JsonReader& reader, const std::string& key) {
  double code[3];
  if (value.is_string()) {
    const std::string text = value.get<std::string>();
    bool right = text.size() == 7 && text[0] == '#';
    for (std::size_t i = 0; right && i < 3; ++i) {
      unsigned byte = 0;
      const char* const two = text.data() + 1 + 2 * i;
      const auto [end, error] = std::from_chars(two, two + 2, byte, 16);
      right = error == std::errc() && end == two + 2;
      code[i] = byte / 255.0;
    }
    if (!right) reader.Fail(key, "must be a colour \"#rrggbb\"");
  } else {
    if (!value.is_array() || value.size() != 3) reader.Fail(key, "must be a colour [r, g, b] or \"#rrggbb\"");
    for (std::size_t i = 0; i < 3; ++i) {
      if (!value[i].is_number() || !(value[i].get<double>() >= 0))
        reader.Fail(key, "must be a colour [r, g, b], each >= 0");
      code[i] = value[i].get<double>();
    }
  }
  const Rgb light(static_cast<float>(LightFromCode(code[0])), static_cast<float>(LightFromCode(code[1])),
                  static_cast<float>(LightFromCode(code[2])));
  if (!std::isfinite(light.sum())) reader.Fail(key, "is brighter than can be held");
  return light;
}

// Position of `text` among names; fails naming all of them.
std::size_t OneOf(JsonReader& reader, const std::string& key, const std::string& text,
                  const std::vector<std::string>& names) {
  std::string known;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == text) return i;
    known += (i == 0 ? "" : ", ") + names[i];
  }
  reader.Fail(key, "\"" + text + "\" is not one of " + known);
}

int MaterialByName(JsonReader& reader, const nlohmann::json& value, const ParseContext& context,
                   const std::string& key) {
  if (!value.is_string()) reader.Fail(key, "must be the name of a material");
  const std::string name = value.get<std::string>();
  const auto& materials = context.scene->materials;
  for (std::size_t i = 0; i < materials.size(); ++i)
    if (materials[i].name == name) return static_cast<int>(i);
  reader.Fail(key, "there is no material \"" + name + "\"");
}

std::filesystem::path ExistingFile(JsonReader& reader, const std::string& key, const ParseContext& context) {
  const std::filesystem::path file = context.folder / reader.RequireText(key);
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) reader.Fail(key, "there is no file " + file.string());
  context.scene->files.push_back(file);
  return file;
}

Eigen::Vector3d PositiveSize(JsonReader& reader, const std::string& key, bool flat) {
  const auto numbers = reader.Numbers(key, flat ? 2 : 3);
  for (const double n : numbers)
    if (!(n > 0)) reader.Fail(key, "must be > 0");
  return {numbers[0], numbers[1], flat ? 0.0 : numbers[2]};
}

// {"centre": [x, y, z], "half_size": [across, along up]}, or these five numbers in a row.
LoftSection ParseSection(const nlohmann::json& node, const ParseContext& context, const std::string& place) {
  LoftSection section;
  const nlohmann::json row{{"section", node}};
  JsonReader reader(node.is_array() ? row : node, context.name, place);
  if (node.is_array()) {
    const auto n = reader.Numbers("section", 5);
    section = {{n[0], n[1], n[2]}, {n[3], n[4]}};
  } else {
    section = {reader.RequireVector3("centre"), reader.Vector2("half_size", {1, 1})};
  }
  if (!(section.half_size.minCoeff() > 0)) reader.Fail("half_size", "must be > 0");
  reader.Done();
  return section;
}

void ParseShape(JsonReader& reader, const ParseContext& context, ObjectDescription& object) {
  switch (object.kind) {
    case ShapeKind::kQuad: object.size = PositiveSize(reader, "size", true); break;
    case ShapeKind::kBox:
    case ShapeKind::kTube: object.size = PositiveSize(reader, "size", false); break;
    case ShapeKind::kHeightfield:
      object.size = PositiveSize(reader, "size", false);
      object.wavelength = reader.Number("wavelength", 0.3 * object.size.x(), Range::kPositive);
      break;
    case ShapeKind::kSphere:
      if (reader.Require("radius").is_array()) {  // an ellipsoid: a sphere of radius z, scaled in x and y
        const Eigen::Vector3d radii = PositiveSize(reader, "radius", false);
        object.radius = radii.z();
        object.world_from_object.scale(radii / radii.z());
      } else {
        object.radius = reader.RequireNumber("radius", Range::kPositive);
      }
      break;
    case ShapeKind::kCylinder:
      object.radius = reader.RequireNumber("radius", Range::kPositive);
      object.top_radius = reader.Number("top_radius", object.radius, Range::kNotNegative);
      object.height = reader.RequireNumber("height", Range::kPositive);
      break;
    case ShapeKind::kLoft:
      for (const auto& [node, place] : reader.Array("sections"))
        object.sections.push_back(ParseSection(*node, context, place));
      if (object.sections.size() < 2) reader.Fail("sections", "needs at least 2");
      object.squareness = reader.Number("squareness", 2, Range::kPositive);
      object.loft_up = reader.Vector3("up", Eigen::Vector3d::UnitZ());
      if ((object.sections.back().centre - object.sections.front().centre).cross(object.loft_up).norm() < 1e-9)
        reader.Fail("up", "must not be along the loft");
      break;
    case ShapeKind::kMesh: object.file = ExistingFile(reader, "file", context); break;
  }
  object.segments = reader.Integer("segments", 96, 3, 2048);
}

Eigen::Affine3d ParseTransform(JsonReader& reader) {
  const Eigen::Vector3d position = reader.Vector3("position", Eigen::Vector3d::Zero());
  const Eigen::Vector3d angle = reader.Vector3("rotate_deg", Eigen::Vector3d::Zero()) * kRadPerDeg;
  const Eigen::Vector3d scale = reader.Vector3("scale", Eigen::Vector3d::Ones());
  if (!(scale.minCoeff() > 0)) reader.Fail("scale", "must be > 0");
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  transform.translate(position)
      .rotate(Eigen::AngleAxisd(angle.z(), Eigen::Vector3d::UnitZ()) *
              Eigen::AngleAxisd(angle.y(), Eigen::Vector3d::UnitY()) *
              Eigen::AngleAxisd(angle.x(), Eigen::Vector3d::UnitX()))
      .scale(scale);
  return transform;
}

// Where the copies stand from the first, which is one of them.
std::vector<Eigen::Vector3d> ParseCopies(JsonReader& reader, const ParseContext& context) {
  const auto* node = reader.Find("copies");
  if (node == nullptr) return {Eigen::Vector3d::Zero()};
  JsonReader copies(*node, context.name, reader.Place("copies"));
  const Eigen::Vector3d count = copies.RequireVector3("count"), step = copies.RequireVector3("step");
  if (!(count.minCoeff() >= 1 && count.prod() <= 100000 && count == count.array().floor().matrix()))
    copies.Fail("count", "must be whole numbers >= 1, at most 100000 in all");
  copies.Done();
  std::vector<Eigen::Vector3d> offsets;
  for (int z = 0; z < count.z(); ++z)
    for (int y = 0; y < count.y(); ++y)
      for (int x = 0; x < count.x(); ++x) offsets.emplace_back(x * step.x(), y * step.y(), z * step.z());
  return offsets;
}

SpinDescription ParseSpin(const nlohmann::json& node, const ParseContext& context, const std::string& place,
                          const Eigen::Vector3d& centre) {
  JsonReader turn(node, context.name, place);
  SpinDescription spin;
  spin.axis = turn.Vector3("axis", Eigen::Vector3d::UnitZ());
  if (!(spin.axis.norm() > 0)) turn.Fail("axis", "must not be zero");
  spin.axis.normalize();
  spin.centre = turn.Vector3("centre", centre);
  spin.period_s = turn.RequireNumber("period_s", Range::kPositive);
  spin.unsteady = turn.Number("unsteady", 0);
  if (!(spin.unsteady >= 0 && spin.unsteady <= 1)) turn.Fail("unsteady", "must be within 0 and 1");
  turn.Done();
  return spin;
}

// Adds parts to the scene's count; fails beyond kMostParts.
void Count(JsonReader& reader, const ParseContext& context, std::size_t parts) {
  if ((*context.parts += parts) > kMostParts)
    reader.Fail("the scene has more than " + std::to_string(kMostParts) + " objects, with their copies and parts");
}

// How many parts each copy of an object counts as.
std::size_t PartsOf(const ObjectDescription& object) {
  constexpr std::size_t kBytesOfText = 64;
  return 1 + object.sections.size() + (object.name.size() + object.file.native().size()) / kBytesOfText;
}

void ParseGroup(JsonReader& reader, const ParseContext& context, const std::vector<Eigen::Affine3d>& places,
                const GroupDescription& parent) {
  if (parent.depth == kDeepestGroup)
    reader.Fail("groups are nested more than " + std::to_string(kDeepestGroup) + " deep");
  Count(reader, context, places.size());
  const auto parts = reader.Array("objects");
  if (parts.empty()) reader.Fail("objects", "needs at least one");
  GroupDescription group = parent;
  ++group.depth;
  if (reader.Has("foreground")) group.foreground = reader.Flag("foreground", true);
  for (const Eigen::Affine3d& world_from_group : places) {
    group.world_from_group = world_from_group;
    if (const auto* spin = reader.Find("spin"); spin != nullptr)
      group.spin = ParseSpin(*spin, context, reader.Place("spin"), world_from_group.translation());
    for (const auto& [node, place] : parts) ParseObject(*node, context, place, group);
  }
  reader.Done();
}

}  // namespace

Rgb ParseColor(JsonReader& reader, const std::string& key, const Rgb& fallback) {
  const nlohmann::json* value = reader.Find(key);
  return value == nullptr ? fallback : ColorFromJson(*value, reader, key);
}

TextureDescription ParseTexture(const nlohmann::json& node, const ParseContext& context, const std::string& place) {
  static const std::vector<std::string> kKinds = {"constant", "noise", "cells",  "bricks", "tiles",
                                                  "stripes",  "wood",  "glyphs", "image",  "checker"};
  JsonReader reader(node, context.name, place);
  TextureDescription texture;
  texture.kind = static_cast<TextureKind>(OneOf(reader, "kind", reader.Text("kind", "constant"), kKinds));
  if (reader.Has("colors")) {
    texture.colors.clear();
    for (const auto& [color, unused] : reader.Array("colors"))
      texture.colors.push_back(ColorFromJson(*color, reader, "colors"));
    if (texture.colors.empty()) reader.Fail("colors", "needs at least one");
  } else {
    texture.colors = {ParseColor(reader, "color", Rgb(0.5f, 0.5f, 0.5f))};
  }
  if (const auto* size = reader.Find("size"); size != nullptr && size->is_number()) {
    texture.size.setConstant(reader.Number("size", 0.1, Range::kPositive));
  } else {
    texture.size = reader.Vector2("size", texture.size);
    if (!(texture.size.minCoeff() > 0)) reader.Fail("size", "must be > 0");
  }
  texture.octaves = reader.Integer("octaves", 5, 1, 16);
  texture.gain = reader.Number("gain", 0.55, Range::kPositive);
  texture.contrast = reader.Number("contrast", 1, Range::kPositive);
  texture.bands = reader.Integer("bands", 0, 0, 64);
  texture.joint = reader.Number("joint", 0.06, Range::kNotNegative);
  texture.joint_color = ParseColor(reader, "joint_color", texture.joint_color);
  texture.variation = reader.Number("variation", 0.15, Range::kNotNegative);
  texture.grain = reader.Number("grain", 0, Range::kNotNegative);
  texture.grain_size = reader.Number("grain_size", 0.01, Range::kPositive);
  texture.seed = static_cast<std::uint32_t>(reader.Integer("seed", 0, 0));
  if (texture.kind == TextureKind::kImage) texture.file = ExistingFile(reader, "file", context);
  reader.Done();
  return texture;
}

MaterialDescription ParseMaterial(const nlohmann::json& node, const ParseContext& context, const std::string& place) {
  JsonReader reader(node, context.name, place);
  MaterialDescription material;
  material.name = reader.RequireText("name");
  if (const auto* texture = reader.Find("texture"); texture != nullptr)
    material.texture = ParseTexture(*texture, context, reader.Place("texture"));
  else
    material.texture.colors = {ParseColor(reader, "color", material.texture.colors[0])};
  material.lit = reader.Flag("lit", true);
  material.specular = reader.Number("specular", 0, Range::kNotNegative);
  material.shininess = reader.Number("shininess", 60, Range::kPositive);
  material.mirror = reader.Number("mirror", 0, Range::kNotNegative);
  if (material.mirror > 1) reader.Fail("mirror", "must be <= 1");
  material.roughness = reader.Number("roughness_deg", 0, Range::kNotNegative) * kRadPerDeg;
  reader.Done();
  return material;
}

void ParseObject(const nlohmann::json& node, const ParseContext& context, const std::string& place,
                 const GroupDescription& group) {
  static const std::vector<std::string> kKinds = {"quad",        "box",  "sphere", "cylinder", "tube",
                                                  "heightfield", "loft", "mesh",   "group"};
  JsonReader reader(node, context.name, place);
  const std::size_t kind = OneOf(reader, "kind", reader.RequireText("kind"), kKinds);
  const Eigen::Affine3d group_from_object = ParseTransform(reader);
  std::vector<Eigen::Affine3d> places;
  for (const Eigen::Vector3d& offset : ParseCopies(reader, context))
    places.push_back(group.world_from_group * Eigen::Translation3d(offset) * group_from_object);
  if (kKinds[kind] == "group") return ParseGroup(reader, context, places, group);
  ObjectDescription object;
  object.kind = static_cast<ShapeKind>(kind);
  object.name = reader.Text("name", "");
  object.materials.clear();
  if (const auto& material = reader.Require("material"); material.is_array()) {
    for (const auto& [value, unused] : reader.Array("material"))
      object.materials.push_back(MaterialByName(reader, *value, context, "material"));
    const bool fits = object.kind == ShapeKind::kTube && object.materials.size() == 4;
    if (!fits) reader.Fail("material", "must be one name; four (floor, left, ceiling, right) for a tube");
  } else {
    object.materials = {MaterialByName(reader, material, context, "material")};
  }
  ParseShape(reader, context, object);
  const Eigen::Affine3d shape = object.world_from_object;
  const bool surroundings =
      object.kind == ShapeKind::kQuad || object.kind == ShapeKind::kTube || object.kind == ShapeKind::kHeightfield;
  object.foreground = reader.Flag("foreground", group.foreground.value_or(!surroundings));
  object.spin = group.spin;
  Count(reader, context, places.size() * PartsOf(object));
  for (const Eigen::Affine3d& world_from_object : places) {
    object.world_from_object = world_from_object * shape;
    if (const auto* spin = reader.Find("spin"); spin != nullptr)
      object.spin = ParseSpin(*spin, context, reader.Place("spin"), world_from_object.translation());
    context.scene->objects.push_back(object);
  }
  reader.Done();
}

}  // namespace lumi
