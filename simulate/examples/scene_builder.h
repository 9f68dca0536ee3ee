// Puts a scene's JSON together in code: what the examples are written with.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace lumi {

class SceneBuilder {
 public:
  using Json = nlohmann::ordered_json;

  explicit SceneBuilder(const std::string& name) { scene_["name"] = name; }

  Json& operator[](const char* key) { return scene_[key]; }
  // `more`: specular, mirror ... of the material.
  void Material(const std::string& name, const Json& texture, const Json& more = Json::object());
  // Each returns the object, for keys beyond these; valid until the next one is added. Positions are those of the
  // middle of what it stands on (spheres and quads: of the centre).
  Json& Box(const std::string& material, const Json& size, double x, double y, double z, double turn_deg = 0);
  Json& Sphere(const std::string& material, double radius, double x, double y, double z);
  Json& Cylinder(const std::string& material, double radius, double height, double x, double y, double z);
  Json& Quad(const std::string& material, const Json& size, const Json& position, const Json& rotate_deg);
  // sections: [[x, y, z, half across, half along up], ...]
  Json& Loft(const std::string& material, const Json& sections, const Json& up, double squareness = 2);

  std::string Text() const { return scene_.dump(1) + "\n"; }

 private:
  Json& Add(const char* kind, const std::string& material);
  Json scene_;
};

}  // namespace lumi
