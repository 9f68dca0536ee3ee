#include "simulate/examples/scene_builder.h"

namespace lumi {

void SceneBuilder::Material(const std::string& name, const Json& texture, const Json& more) {
  Json material = {{"name", name}, {"texture", texture}};
  material.update(more);
  scene_["materials"].push_back(material);
}

SceneBuilder::Json& SceneBuilder::Add(const char* kind, const std::string& material) {
  scene_["objects"].push_back({{"kind", kind}, {"material", material}});
  return scene_["objects"].back();
}

SceneBuilder::Json& SceneBuilder::Box(const std::string& material, const Json& size, double x, double y, double z,
                                      double turn_deg) {
  Json& object = Add("box", material);
  object["size"] = size;
  object["position"] = {x, y, z + 0.5 * size[2].get<double>()};
  if (turn_deg != 0) object["rotate_deg"] = {0, 0, turn_deg};
  return object;
}

SceneBuilder::Json& SceneBuilder::Sphere(const std::string& material, double radius, double x, double y, double z) {
  Json& object = Add("sphere", material);
  object["radius"] = radius;
  object["position"] = {x, y, z};
  return object;
}

SceneBuilder::Json& SceneBuilder::Cylinder(const std::string& material, double radius, double height, double x,
                                           double y, double z) {
  Json& object = Add("cylinder", material);
  object["radius"] = radius;
  object["height"] = height;
  object["position"] = {x, y, z};
  return object;
}

SceneBuilder::Json& SceneBuilder::Quad(const std::string& material, const Json& size, const Json& position,
                                       const Json& rotate_deg) {
  Json& object = Add("quad", material);
  object["size"] = size;
  object["position"] = position;
  object["rotate_deg"] = rotate_deg;
  return object;
}

SceneBuilder::Json& SceneBuilder::Loft(const std::string& material, const Json& sections, const Json& up,
                                       double squareness) {
  Json& object = Add("loft", material);
  for (const Json& s : sections)
    object["sections"].push_back({{"centre", {s[0], s[1], s[2]}}, {"half_size", {s[3], s[4]}}});
  object["up"] = up;
  object["squareness"] = squareness;
  return object;
}

}  // namespace lumi
