#include "simulate/examples.h"

#include "scene/program/error.h"

namespace lumi {
namespace {

struct Entry {
  Example example;
  std::string (*json)();
};

const std::vector<Entry>& Entries() {
  static const std::vector<Entry> kEntries = {
      {{"desk", "items on a desk before a dark background, 262 photos in 13 clusters"}, DeskJson},
      {{"plaza", "a paved square before houses, 480 frames of a hand-held walk"}, PlazaJson},
      {{"hallway", "a corridor with a glossy floor, 1096 frames driving forward"}, HallwayJson},
      {{"car", "a glossy car alone, 36 photos on a ring"}, CarJson},
      {{"person", "a person alone, 4 photos on a half circle"}, PersonJson},
      {{"boards", "a checkerboard (9x6, 25 mm) before a lens with distortion and skew, 16 photos"}, BoardsJson},
      {{"lamp", "a turning lamp filmed by a waved camera, 2000 frames, period 150.37 frames; fixed.mp4 beside"}, LampJson},
      {{"helicopter", "a helicopter's rotor filmed by a waved camera, 900 frames, period 15.37 frames; fixed.mp4 beside"}, HelicopterJson},
      {{"vertigo", "a bear in a room, 240 frames of a camera that moves in by hand and zooms out, so that the bear should keep its size"}, VertigoJson},
      {{"stage", "two turning things filmed by 8 cameras on tripods at once, started at different frames; videos/ beside"}, StageJson},
  };
  return kEntries;
}

}  // namespace

std::vector<Example> Examples() {
  std::vector<Example> examples;
  for (const Entry& entry : Entries()) examples.push_back(entry.example);
  return examples;
}

std::string ExampleJson(const std::string& name) {
  std::string names;
  for (const Entry& entry : Entries()) {
    if (entry.example.name == name) return entry.json();
    names += (names.empty() ? "" : ", ") + entry.example.name;
  }
  throw UsageError("there is no example \"" + name + "\"", "there are: " + names);
}

}  // namespace lumi
