// Prints how far two reconstructions of the same photos are apart: what another seed, or another release, changes.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "scene/files/scene_folder.h"
#include "scene/geometry/similarity3.h"
#include "scene/program/main_program.h"

namespace lumi {
namespace {

Scene Open(const std::filesystem::path& path, ProgressSink& progress) {
  OpenOptions cameras_as_they_are;
  cameras_as_they_are.check_photos = false;
  cameras_as_they_are.undistort = false;
  Scene scene = OpenScene(path, cameras_as_they_are, progress);
  RequireMetric(scene, "pose_difference");
  return scene;
}

struct PoseDifference {
  std::size_t views_a = 0, views_b = 0, views_matched = 0;
  PoseErrors poses;       // of A after a similarity; B's centres are the extent
  double focal_a_px = 0;  // means over the views that both have
  double focal_b_px = 0;
  double focal_max_percent = 0;  // of B's: the view that differs most
};

void ListKeys(JsonKeys& j, PoseDifference& d) {
  j("views_a", d.views_a, "views_b", d.views_b, "views_matched", d.views_matched);
  j("centre_rms_percent", d.poses.centre_rms_percent, "centre_max_percent", d.poses.centre_max_percent);
  j("rotation_rms_deg", d.poses.rotation_rms_deg, "rotation_max_deg", d.poses.rotation_max_deg);
  j("focal_a_px", d.focal_a_px, "focal_b_px", d.focal_b_px, "focal_max_percent", d.focal_max_percent);
}

PoseDifference Compare(const Scene& a, const Scene& b) {
  std::map<std::string, const View*> in_b;
  for (const View& view : b.views) in_b[view.name] = &view;
  PoseDifference d;
  d.views_a = a.views.size();
  d.views_b = b.views.size();
  std::vector<Rigid3> poses_a, poses_b;
  for (const View& view : a.views) {
    const auto same = in_b.find(view.name);
    if (same == in_b.end()) continue;
    poses_a.push_back(view.cam_from_world);
    poses_b.push_back(same->second->cam_from_world);
    const double focal_a = a.CameraOf(view).FocalPx().mean(), focal_b = b.CameraOf(*same->second).FocalPx().mean();
    d.focal_a_px += focal_a;
    d.focal_b_px += focal_b;
    d.focal_max_percent = std::max(d.focal_max_percent, 100 * std::abs(focal_a - focal_b) / focal_b);
  }
  d.views_matched = poses_a.size();
  if (d.views_matched < 3) throw DataError("the scenes have fewer than three photos in common");
  d.focal_a_px /= static_cast<double>(d.views_matched);
  d.focal_b_px /= static_cast<double>(d.views_matched);
  d.poses = ComparePoses(poses_a, poses_b);
  return d;
}

}  // namespace
}  // namespace lumi

int main(int argc, char** argv) {
  lumi::Program program("pose_difference",
                        "Prints how far the cameras of two scenes of the same photos are apart, after a similarity");
  std::filesystem::path a, b;
  program.options().Add("scene_a", a, "Scene folder, COLMAP workspace or transforms.json").Required();
  program.options().Add("scene_b", b, "Another one; its centres are the extent that percents are of").Required();

  program.RunAndExit(argc, argv, [&] {
    const lumi::JsonKeys keys(lumi::Compare(lumi::Open(a, program.progress()), lumi::Open(b, program.progress())));
    return lumi::Answer(keys, keys.Text(2));
  });
}
