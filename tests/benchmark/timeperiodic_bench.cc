// What docs/timeperiodic.md quotes: periods of the simulated lamp and helicopter against the truth, and their pictures
// at unseen places and phases against the width of the time window and the distance to the nearest photo.
//
//   timeperiodic_bench WORK [DATA]
//     WORK/lamp, WORK/helicopter: captures of lumi-simulate; DATA: with pendulum/
//   timeperiodic_bench unseen EXAMPLE CAPTURE
//     pictures from places where no photo is
//   timeperiodic_bench reconstructed EXAMPLE CAPTURE SCENE [PROXY]
//     what lumi-pipeline --periodic made of its video
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "scene/program/subprocess.h"
#include "scene/program/with_error.h"

namespace {

namespace fs = std::filesystem;
using namespace lumi;
using nlohmann::json;

json Run(const std::string& program, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), SiblingProgram(program).string());
  arguments.insert(arguments.end(), {"--json", "--quiet"});
  SubprocessOptions options;
  options.separate_stdout = true;
  const SubprocessResult result = RunSubprocess(arguments, options);
  if (result.exit_code != 0) throw MachineError(program + " failed: " + result.out);
  return json::parse(result.out);
}

void Row(const std::string& name, const fs::path& video, bool moving, double truth) {
  std::vector<std::string> arguments{"period", video.string()};
  if (moving) arguments.emplace_back("--moving");
  const json j = Run("lumi-timeperiodic", arguments);
  const double period = j["period_frames"];
  std::printf("| %s | %d | %.2f | %s | %+.5f | %.1f |\n", name.c_str(), j["frames"].get<int>(), truth,
              WithError(period, j["period_sigma_frames"].get<double>()).c_str(), 100 * (period / truth - 1),
              j["seconds"].get<double>());
  std::fflush(stdout);
}

constexpr std::array<double, 5> kWindows{0.5, 1, 2, 4, 8};  // frames

struct UnseenView {
  Rigid3 cam_from_world;
  double phase = 0;
};

// Seen through a reconstruction's own lens: its photos were, and its cameras' turn is known no better than where their
// axis passes.
json Key(const UnseenView& view, const Camera& camera) {
  const Eigen::Vector3d at = view.cam_from_world.OriginInSource();
  const Eigen::Quaterniond& q = view.cam_from_world.rotation;
  json key{
      {"position", {at.x(), at.y(), at.z()}},
      {"cam_from_world_xyzw", {q.x(), q.y(), q.z(), q.w()}},
      {"vertical_fov_deg", 2 * std::atan(0.5 * camera.height_px / camera.FocalPx().y()) * 180 / 3.141592653589793}};
  const Eigen::Vector2d axis = camera.PrincipalPointPx().array() / Eigen::Array2d(camera.width_px, camera.height_px);
  if (axis != Eigen::Vector2d(0.5, 0.5)) key["principal_point"] = {axis.x(), axis.y()};
  return key;
}

// What the simulation shows from places and at phases where no photo is.
class Unseen {
 public:
  Unseen(std::string example, const Scene& capture, const std::vector<UnseenView>& views)
      : example_(std::move(example)) {
    json path{{"width", capture.cameras[0].width_px}, {"height", capture.cameras[0].height_px}};
    for (const UnseenView& view : views) {
      json key = Key(view, capture.cameras[0]);
      key["phase"] = view.phase;
      path["keys"].push_back(key);
    }
    WriteTextAtomically(work_ / "truth.json", path.dump());
    Run("lumi-simulate", {"--example", example_, "--at", (work_ / "truth.json").string(), "-o",
                          (work_ / "truth").string(), "--width", std::to_string(capture.cameras[0].width_px)});
    for (std::size_t i = 0; i < views.size(); ++i) {
      const std::string name = fmt::format("{}_{:04d}.png", example_, i);
      is_.push_back(ReadImage8(work_ / "truth" / "images" / name));
      moving_.push_back(ReadImage8(work_ / "truth" / "truth" / "moving" / name));
    }
  }

  struct Turn {
    double psnr_db = 0;  // over the pixels where something moves at any time
    double off_px = 0;   // by how much the rest is shifted, rms of the views: what lens and cameras are off as a whole
  };

  // Of lumi-render with these options on a scene, from `views` in the scene's own world, view i of n at phase i / n:
  // one path whose frames are the views.
  Turn OfTurn(const Scene& scene, const std::vector<UnseenView>& views, bool time,
              const std::vector<std::string>& options) const {
    const double step_s = *scene.period_s / static_cast<double>(views.size());
    json path{{"format", "lumigraph-path"},
              {"version", 1},
              {"fps", static_cast<double>(views.size()) / (step_s * static_cast<double>(views.size() - 1))},
              {"width", is_[0].width},
              {"height", is_[0].height}};
    for (std::size_t i = 0; i < views.size(); ++i) {
      json key = Key(views[i], scene.cameras[0]);
      key["time_s"] = step_s * static_cast<double>(i);
      path["keys"].push_back(key);
    }
    WriteTextAtomically(work_ / "path.json", path.dump());
    fs::remove_all(work_ / "out");
    std::vector<std::string> arguments{scene.folder.string(),          "-o",     (work_ / "out").string(), "--path",
                                       (work_ / "path.json").string(), "--time", time ? "on" : "off"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    Run("lumi-render", arguments);
    std::vector<fs::path> frames;
    for (const auto& entry : fs::directory_iterator(work_ / "out" / "frames"))
      if (entry.path().extension() == ".png") frames.push_back(entry.path());
    std::sort(frames.begin(), frames.end());
    if (frames.size() != views.size())
      throw MachineError(fmt::format("{} frames of {} views", frames.size(), views.size()));
    double square = 0, count = 0, off = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const Image8 out = ReadImage8(frames[i]);
      Add(i, out, square, count);
      off += Shift(i, out).squaredNorm() / static_cast<double>(views.size());
    }
    return {10 * std::log10(255 * 255 * count / square), std::sqrt(off)};
  }

 private:
  // The shift (px) that brings a picture onto the truth where nothing ever moves: least squares over the gradient, a
  // few steps.
  Eigen::Vector2d Shift(std::size_t i, const Image8& out) const {
    constexpr int kSteps = 8, kBorder = 12;
    const auto grey = [](const Image8& image, int x, int y) {
      return (image.At(x, y, 0) + image.At(x, y, 1) + image.At(x, y, 2)) / 3.0;
    };
    const auto at = [&](double x, double y) {
      const int u = static_cast<int>(std::floor(x)), v = static_cast<int>(std::floor(y));
      const double a = x - u, b = y - v;
      return (1 - b) * ((1 - a) * grey(out, u, v) + a * grey(out, u + 1, v)) +
             b * ((1 - a) * grey(out, u, v + 1) + a * grey(out, u + 1, v + 1));
    };
    Eigen::Vector2d shift = Eigen::Vector2d::Zero();
    for (int step = 0; step < kSteps; ++step) {
      Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
      Eigen::Vector2d right = Eigen::Vector2d::Zero();
      for (int y = kBorder; y < out.height - kBorder; ++y)
        for (int x = kBorder; x < out.width - kBorder; ++x) {
          if (moving_[i].At(x, y, 0) > 0) continue;
          const Eigen::Vector2d g(0.5 * (grey(is_[i], x + 1, y) - grey(is_[i], x - 1, y)),
                                  0.5 * (grey(is_[i], x, y + 1) - grey(is_[i], x, y - 1)));
          normal += g * g.transpose();
          right += g * (grey(is_[i], x, y) - at(x + shift.x(), y + shift.y()));
        }
      shift += normal.inverse() * right;
      if (!(shift.cwiseAbs().maxCoeff() < kBorder - 2)) return {kBorder, kBorder};
    }
    return shift;
  }

  void Add(std::size_t i, const Image8& out, double& square, double& count) const {
    for (int y = 0; y < out.height; ++y)
      for (int x = 0; x < out.width; ++x)
        for (int c = 0; c < 3 && moving_[i].At(x, y, 0) > 0; ++c, ++count)
          square += std::pow(is_[i].At(x, y, c) - out.At(x, y, c), 2);
  }

  std::string example_;
  std::vector<Image8> is_, moving_;
  TemporaryFolder work_;
};

// A photo's camera moved by `away` (of the extent of the cameras' centres), away from all of them: along the direction
// in which they spread least, across its own axis, to the side that fewer of them are on. How far it then is from the
// nearest of them is what counts.
struct Standpoint {
  Rigid3 cam_from_world;
  double nearest = 0;  // world units
};
Standpoint Away(const Scene& scene, const View& photo, double away) {
  const Eigen::Vector3d centre = photo.cam_from_world.OriginInSource();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const View& v : scene.views) mean += v.cam_from_world.OriginInSource() / static_cast<double>(scene.views.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const View& v : scene.views) {
    const Eigen::Vector3d d = v.cam_from_world.OriginInSource() - mean;
    spread += d * d.transpose();
  }
  const Eigen::Vector3d axis = photo.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  // Of the three main directions the narrowest that is not the axis itself.
  Eigen::Vector3d side = solver.eigenvectors().col(0);
  if (std::abs(side.dot(axis)) > 0.7) side = solver.eigenvectors().col(1);
  side = (side - side.dot(axis) * axis).normalized();
  if (side.dot(centre - mean) < 0) side = -side;
  const Eigen::Vector3d at = centre + away * side;
  Standpoint stand{photo.cam_from_world, std::numeric_limits<double>::infinity()};
  stand.cam_from_world.translation = -(stand.cam_from_world.rotation * at);
  for (const View& v : scene.views)
    stand.nearest = std::min(stand.nearest, (v.cam_from_world.OriginInSource() - at).norm());
  return stand;
}

// The largest distance between two photos' cameras.
double Extent(const Scene& scene) {
  double extent = 0;
  for (const View& a : scene.views)
    for (const View& b : scene.views)
      extent = std::max(extent, (a.cam_from_world.OriginInSource() - b.cam_from_world.OriginInSource()).norm());
  return extent;
}

// Over the simulation's own cameras and billboard, against the window's width and how far the view is from the nearest
// photo's camera: five views a distance.
void Pictures(const std::string& example, const fs::path& capture) {
  const Scene scene = OpenScene(capture, {}, SilentProgress());
  const double frame_s = *scene.views[1].time_s - *scene.views[0].time_s, extent = Extent(scene);
  constexpr std::size_t kViews = 5;
  for (const double away : {0.005, 0.05, 0.1, 0.2, 0.4}) {
    std::vector<UnseenView> views;
    double nearest = 0;
    for (std::size_t i = 0; i < kViews; ++i) {
      const Standpoint at = Away(scene, scene.views[(2 * i + 1) * scene.views.size() / (2 * kViews)], away * extent);
      views.push_back({at.cam_from_world, static_cast<double>(i) / kViews});
      nearest += at.nearest / kViews;
    }
    const Unseen unseen(example, scene, views);
    std::printf("| %.3f | %.1f | %.2f |", nearest, 100 * nearest / extent,
                unseen.OfTurn(scene, views, false, {}).psnr_db);
    for (const double frames : kWindows) {
      const double window_s = frames * frame_s;
      if (window_s > *scene.period_s)
        std::printf(" |");
      else
        std::printf(" %.2f |",
                    unseen.OfTurn(scene, views, true, {"--time-window-s", fmt::format("{}", window_s)}).psnr_db);
    }
    std::printf("\n");
    std::fflush(stdout);
  }
}

// Views midway between two frames' cameras, looking as the first of them does: the same ones in the simulation's world
// and in a reconstruction's, whatever its errors are as a whole.
std::vector<UnseenView> ViewsBetween(const Scene& scene) {
  constexpr std::size_t kViews = 10;
  std::vector<const Rigid3*> of_frame(scene.views.size(), nullptr);
  for (const View& v : scene.views) of_frame.at(static_cast<std::size_t>(*v.frame_index)) = &v.cam_from_world;
  std::vector<UnseenView> views;
  const std::size_t n = of_frame.size();
  for (std::size_t i = 0; i < kViews; ++i) {
    const std::size_t first = (2 * i + 1) * n / (2 * kViews), second = (first + n / 2 + 37 * i) % n;
    if (!of_frame[first] || !of_frame[second]) throw DataError("a frame has no camera");
    Rigid3 pose = *of_frame[first];
    pose.translation = -(pose.rotation * (0.5 * (pose.OriginInSource() + of_frame[second]->OriginInSource())));
    views.push_back({pose, static_cast<double>(i) / kViews});
  }
  return views;
}

// How far a reconstruction's turns are off beside one turn that all cameras share (degrees, rms): such a turn stands
// for a shifted principal point.
double TurnedBesideShared(const std::vector<Rigid3>& of_scene, const std::vector<Rigid3>& of_truth) {
  const Similarity3 truth_from_scene = AlignPoses(of_scene, of_truth);
  std::vector<Eigen::Quaterniond> turned;
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (std::size_t i = 0; i < of_scene.size(); ++i) {
    Eigen::Quaterniond q = TransformPose(of_scene[i], truth_from_scene).rotation * of_truth[i].rotation.conjugate();
    if (q.w() < 0) q.coeffs() *= -1;
    turned.push_back(q);
    sum += q.coeffs();
  }
  const Eigen::Quaterniond shared(Eigen::Vector4d(sum.normalized()));
  double square = 0;
  for (const Eigen::Quaterniond& q : turned) square += std::pow(q.angularDistance(shared) * 180 / M_PI, 2);
  return std::sqrt(square / static_cast<double>(turned.size()));
}

void CameraRow(const std::string& example, const Scene& scene, const Scene& truth) {
  std::vector<Rigid3> of_scene, of_truth;
  double focal = 0, true_focal = 0;
  Eigen::Vector2d principal = Eigen::Vector2d::Zero();
  const auto n = static_cast<double>(scene.views.size());
  for (const View& v : scene.views) {
    const View& t = truth.views.at(static_cast<std::size_t>(*v.frame_index));
    of_scene.push_back(v.cam_from_world);
    of_truth.push_back(t.cam_from_world);
    focal += scene.CameraOf(v).FocalPx().mean() / n;
    true_focal += truth.CameraOf(t).FocalPx().mean() / n;
    principal += (scene.CameraOf(v).PrincipalPointPx() - truth.CameraOf(t).PrincipalPointPx()) / n;
  }
  const PoseErrors errors = ComparePoses(of_scene, of_truth);
  std::printf(
      "| capture | period, frames | frames posed | centres rms %% | focal length off %% | principal point off px | "
      "turned, "
      "rms degrees | of these, beside a turn that all cameras share |\n|---|---|---|---|---|---|---|---|\n| %s | %.4f "
      "| %zu "
      "of %zu | %.2f | %.2f | %.1f | %.3f | %.3f |\n",
      example.c_str(), *scene.period_s * 30, scene.views.size(), truth.views.size(), errors.centre_rms_percent,
      100 * std::abs(focal - true_focal) / true_focal, principal.norm(), errors.rotation_rms_deg,
      TurnedBesideShared(of_scene, of_truth));
}

// What lumi-pipeline --periodic made of the video alone, over each of its proxies.
void Reconstructed(const std::string& example, const fs::path& capture, const fs::path& made, const std::string& only) {
  const Scene truth = OpenScene(capture, {}, SilentProgress());
  const Scene scene = OpenScene(made, {}, SilentProgress());
  CameraRow(example, scene, truth);
  std::printf(
      "\n### %s, unseen views between frames\n\n| PSNR over what moves at any time, dB | without time | window of 1 "
      "frame | "
      "2 frames | the still part is off, px |\n|---|---|---|---|---|\n",
      example.c_str());
  const std::vector<UnseenView> in_truth = ViewsBetween(truth), in_scene = ViewsBetween(scene);
  const Unseen unseen(example, truth, in_truth);
  std::vector<double> times;
  for (const View& v : scene.views) times.push_back(*v.time_s);
  std::sort(times.begin(), times.end());
  const double frame_s = (times.back() - times.front()) / static_cast<double>(times.size() - 1);
  const auto row = [&](const std::string& what, const Scene& s, const std::vector<UnseenView>& views,
                       const std::string& proxy) {
    std::printf("| %s, %s, %s%s |", example.c_str(), what.c_str(), proxy.c_str(),
                proxy == s.active_proxy ? " (chosen)" : "");
    Unseen::Turn turn = unseen.OfTurn(s, views, false, {"--proxy", proxy});
    std::printf(" %.2f |", turn.psnr_db);
    for (const double frames : {1.0, 2.0}) {
      turn = unseen.OfTurn(s, views, true, {"--proxy", proxy, "--time-window-s", fmt::format("{}", frames * frame_s)});
      std::printf(" %.2f |", turn.psnr_db);
      std::fflush(stdout);
    }
    std::printf(" %.2f |\n", turn.off_px);
  };
  if (only.empty()) row("true cameras", truth, in_truth, "billboard");
  for (const std::string& proxy : ListProxies(made))
    if (only.empty() || proxy == only) row("reconstructed", scene, in_scene, proxy);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2)
    return std::fprintf(stderr,
                        "timeperiodic_bench WORK [DATA] | unseen EXAMPLE CAPTURE | reconstructed EXAMPLE CAPTURE SCENE "
                        "[PROXY]\n"),
           2;
  const fs::path work = argv[1];
  try {
    if (argc > 4 && std::string(argv[1]) == "reconstructed")
      return Reconstructed(argv[2], argv[3], argv[4], argc > 5 ? argv[5] : ""), 0;
    if (argc == 4 && std::string(argv[1]) == "unseen") {
      std::printf("| nearest camera | %% of extent | without time |");
      for (const double frames : kWindows) std::printf(" window %g |", frames);
      std::printf("\n|---|---|---|---|---|---|---|---|\n");
      return Pictures(argv[2], argv[3]), 0;
    }
    std::printf("| video | frames | true period | found | error %% | seconds |\n|---|---|---|---|---|---|\n");
    for (const auto& [name, truth] : {std::pair{"lamp", 150.37}, std::pair{"helicopter", 15.37}}) {
      Row(fmt::format("{}, tripod", name), work / name / "fixed.mp4", false, truth);
      Row(fmt::format("{}, waved camera", name), work / name / "video.mp4", true, truth);
    }
    if (argc > 2 && fs::exists(fs::path(argv[2]) / "pendulum"))
      Row("pendulum (counted by eye)", fs::path(argv[2]) / "pendulum" / "clock.mpg", false, 22);
  } catch (const Error& e) {
    return std::fprintf(stderr, "timeperiodic_bench: %s\n", e.what()), static_cast<int>(e.code());
  }
}
