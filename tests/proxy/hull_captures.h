// Silhouettes of photographs of real things, with their cameras, from the folder of captures.
#pragma once

#include <Eigen/Core>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "proxy/hull/silhouette_cone.h"
#include "proxy/silhouettes/colour_rule.h"
#include "proxy/silhouettes/silhouette.h"
#include "scene/files/image_io.h"

namespace lumi::test {

// w > 0 in front: `inside` is a point of the object.
inline SilhouetteView CaptureView(const std::filesystem::path& photo, const Matrix34d& P, const Eigen::Vector3d& inside,
                                  const ColourRule& rule, const CleanOptions& clean) {
  SilhouetteView view;
  view.name = photo.filename().string();
  view.P = WithSign(P, inside.homogeneous());
  view.mask = Clean(SilhouetteFromRule(ReadImage8(photo), rule), clean);
  if (const char* folder = std::getenv("HULL_OUT"))
    WriteImage(std::filesystem::path(folder) / (view.name + ".png"), view.mask);
  return view;
}

inline std::vector<SilhouetteView> DinosaurSilhouettes(const std::filesystem::path& data) {
  std::vector<SilhouetteView> views;
  std::ifstream file(data / "dinosaur" / "dino_P.txt");
  const ColourRule rule("(B - R) < 25 && R + G + B > 60");
  CleanOptions clean;
  clean.min_radius_px = 4;
  clean.min_hole_px = 30;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string name;
    Matrix34d P;
    words >> name;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c) words >> P(r, c);
    if (!words || name == "viff.036.png") continue;  // the last is a copy of the first
    const std::string number = name.substr(5, 3);
    views.push_back(
        CaptureView(data / "dinosaur" / "images" / ("viff" + number + ".jpg"), P, {0, -0.03, -0.63}, rule, clean));
  }
  return views;
}

// The photos whose silhouettes the data set's authors could find, in others a shadow of the gantry lies on the object;
// or all.
inline std::vector<SilhouetteView> DinoRingsSilhouettes(const std::filesystem::path& data, int every, bool good_ones) {
  std::vector<SilhouetteView> views;
  std::set<std::string> good;
  std::ifstream list(data / "dino-rings" / "upstream_dino_good_silhouette_images.txt");
  for (std::string name; list >> name;) good.insert(name);
  std::ifstream file(data / "dino-rings" / "dino_par.txt");
  // The authors' recipe: threshold 0.19, widened by 10 pixels, narrowed by 7.
  const ColourRule rule("max(R, max(G, B)) > 48");
  CleanOptions clean;
  clean.close_px = 10;
  clean.grow_px = 3;
  clean.min_radius_px = 6;
  clean.min_hole_px = 100000;  // it has none: shadows
  std::string line;
  std::getline(file, line);
  for (int n = 0; std::getline(file, line);) {
    std::istringstream words(line);
    std::string name;
    Eigen::Matrix3d K, R;
    Eigen::Vector3d t;
    words >> name;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) words >> K(r, c);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) words >> R(r, c);
    for (int r = 0; r < 3; ++r) words >> t(r);
    if (!words || (good_ones && good.count(name) == 0) || n++ % every != 0) continue;
    Matrix34d P;
    P.leftCols<3>() = K * R;
    P.col(3) = K * t;
    views.push_back(CaptureView(data / "dino-rings" / "images" / std::filesystem::path(name).replace_extension(".jpg"),
                                P, {-0.005, 0.045, 0}, rule, clean));
  }
  return views;
}

}  // namespace lumi::test
