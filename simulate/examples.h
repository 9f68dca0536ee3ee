// Scenes that come with the program, after the five examples of the thesis (Buehler 2002, sections 4.4 and 5.3). Each
// is JSON like any other scene: truth/scene.json of a capture is a template for one's own.
#pragma once

#include <string>
#include <vector>

namespace lumi {

struct Example {
  std::string name;
  std::string description;  // one line
};
std::vector<Example> Examples();

// Throws UsageError naming those that exist.
std::string ExampleJson(const std::string& name);

// Items on a desk before a dark background; 262 photos in 13 clusters.
std::string DeskJson();
// A paved square with a backdrop of houses; 480 frames of a hand-held walk.
std::string PlazaJson();
// A corridor with a glossy floor; 1096 frames driving forward.
std::string HallwayJson();
// A glossy car on a plain ground; 36 photos on a ring.
std::string CarJson();
// A person; 4 photos on a half circle.
std::string PersonJson();
// A checkerboard on a table before a lens with distortion and skew; 16 photos.
std::string BoardsJson();
// A turning lamp with balls on its arms in a still room; 2000 frames of a hand-held camera that waves, period 150.37 frames.
std::string LampJson();
// A toy helicopter with a turning rotor; 900 frames likewise, period 15.37 frames, with motion blur.
std::string HelicopterJson();
// A bear in the lamp's room; 240 frames of a hand-held camera that moves in and zooms out, badly.
std::string VertigoJson();
// The lamp's room with two things that turn at speeds of their own; 8 cameras on tripods that were not started together.
std::string StageJson();

}  // namespace lumi
