#include "simulate/capture.h"

#include <fmt/format.h>

#include <mutex>
#include <nlohmann/json.hpp>
#include <set>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/image_io.h"
#include "scene/files/json_limits.h"
#include "scene/files/mesh_io.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/files/video.h"
#include "scene/geometry/angle.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/program/stopwatch.h"
#include "scene/program/version.h"
#include "simulate/examples.h"
#include "simulate/json_reader.h"
#include "simulate/surface_points.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kStaging = ".simulating";  // where a capture grows until it is whole

// Everything of a capture is made here and moved to its place at the end; what an earlier run that was killed left is
// cleared.
class Staging {
 public:
  explicit Staging(fs::path output) : output_(std::move(output)), folder_(output_ / kStaging) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  // If moving was interrupted, an empty staging folder stays: it marks the output as ours until the capture is made
  // again.
  ~Staging() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
    if (moving_) fs::create_directories(folder_, ignored);
  }
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;
  const fs::path& folder() const { return folder_; }

  void Begin() { moving_ = true; }
  void End() { moving_ = false; }
  void MoveIntoPlace(const fs::path& name) const {
    fs::remove_all(output_ / name);
    if (!fs::exists(folder_ / name)) return;
    fs::create_directories((output_ / name).parent_path());
    fs::rename(folder_ / name, output_ / name);
  }

 private:
  fs::path output_, folder_;
  bool moving_ = false;
};

struct Source {
  std::string text;
  fs::path name;    // what messages name
  fs::path folder;  // of relative paths
};

Source ReadSource(const SimulateOptions& options) {
  if (!options.example.empty()) return {ExampleJson(options.example), "example " + options.example, "."};
  constexpr std::size_t kMaxBytes = 64u << 20;
  return {ReadText(options.scene_file, kMaxBytes), options.scene_file, options.scene_file.parent_path()};
}

std::string TextFingerprint(const std::string& text) {  // FNV-1a, 64 bits
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return fmt::format("{:016x}-{}", hash, text.size());
}

Provenance WantedProvenance(const SimulateOptions& options, const Source& source, const SceneDescription& scene) {
  Provenance wanted;
  wanted.stage = "simulate";
  wanted.version = kVersion;
  wanted.options = {{"views", std::to_string(options.views)},
                    {"width", std::to_string(options.width_px)},
                    {"seed", std::to_string(options.seed)}};
  if (options.video) wanted.options["video"] = "true";
  if (options.shake) wanted.options["shake"] = fmt::format("{}", *options.shake);
  if (options.steady) wanted.options["steady"] = "true";
  if (options.blur_s) wanted.options["blur_s"] = fmt::format("{}", *options.blur_s);
  if (options.blur_every != 0) wanted.options["blur_every"] = std::to_string(options.blur_every);
  if (options.portrait_every != 0) wanted.options["portrait_every"] = std::to_string(options.portrait_every);
  if (options.vignetting) wanted.options["vignetting"] = fmt::format("{}", *options.vignetting);
  if (options.white_balance_stops)
    wanted.options["white_balance_stops"] = fmt::format("{}", *options.white_balance_stops);
  if (scene.fixed_video || !scene.videos.empty()) wanted.options["fixed_frames"] = std::to_string(options.fixed_frames);
  if (!options.at_file.empty()) wanted.inputs[options.at_file.string()] = Fingerprint(options.at_file);
  wanted.inputs[source.name.string()] = TextFingerprint(source.text);
  for (const fs::path& file : scene.files) wanted.inputs[file.string()] = Fingerprint(file);
  return wanted;
}

Json NumbersOf(const auto& values) {
  Json array = Json::array();
  for (const double value : values) array.push_back(value);
  return array;
}

std::string TrueCamerasJson(const std::vector<PlannedView>& views, const ViewRenderer& renderer) {
  Json json = Json::object();
  json["convention"] = "x_in_cam = R x_in_world + t; x right, y down, z forward; pixel centres at (i + 0.5, j + 0.5)";
  if (renderer.effects().vignetting) json["vignetting"] = *renderer.effects().vignetting;
  for (const PlannedView& view : views) {
    const TrueCamera truth = renderer.CameraOf(view);
    const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> pose = truth.cam_from_world.Matrix();
    json["views"].push_back({{"name", view.name},
                             {"frame_index", view.frame_index},
                             {"time_s", view.time_s},
                             {"gain", truth.gain},
                             {"model", std::string(Name(truth.camera.model))},
                             {"size_px", {truth.camera.width_px, truth.camera.height_px}},
                             {"params", NumbersOf(truth.camera.params)},
                             {"skew_px", truth.skew_px},
                             {"cam_from_world", NumbersOf(pose.reshaped<Eigen::RowMajor>())}});
    if (view.orientation != 1) json["views"].back()["orientation"] = view.orientation;
    if (renderer.effects().white_balance_stops) json["views"].back()["white_balance"] = NumbersOf(truth.white_balance);
  }
  return json.dump(1) + "\n";
}

std::string TimestampsCsv(const std::vector<PlannedView>& views, const ViewRenderer& renderer) {
  std::string csv = "name,frame_index,time_s,gain\n";
  for (const PlannedView& view : views)
    csv += fmt::format("{},{},{:.9g},{:.9g}\n", view.name, view.frame_index, view.time_s, renderer.CameraOf(view).gain);
  return csv;
}

Scene TrueScene(const SceneDescription& description, const std::vector<PlannedView>& views,
                const ViewRenderer& renderer) {
  Scene scene;
  std::vector<int> used(description.cameras.size(), -1);
  for (const PlannedView& planned : views) {
    const TrueCamera truth = renderer.CameraOf(planned);
    int& id = used[static_cast<std::size_t>(planned.camera)];
    if (id < 0 ||
        scene.cameras[static_cast<std::size_t>(id)].params != truth.camera.params) {  // a lens that zooms: one a view
      id = static_cast<int>(scene.cameras.size());
      scene.cameras.push_back(truth.camera);
    }
    View view;
    view.name = planned.name;
    view.camera = CameraId{id};
    view.cam_from_world = truth.cam_from_world;
    view.time_s = planned.time_s;
    view.frame_index = planned.frame_index;
    view.gain = truth.gain;
    view.orientation = planned.orientation;
    scene.views.push_back(std::move(view));
  }
  return scene;
}

// About 150 points a view, within reason.
int PointCount(std::size_t views) { return std::clamp(static_cast<int>(150 * views), 3000, 12000); }

void Add(TraceCounters& sum, const TraceCounters& count) {
  sum.rays += count.rays;
  sum.poses += count.poses;
  sum.noise_draws += count.noise_draws;
}

void RenderPhotos(const std::vector<PlannedView>& views, const SceneDescription& scene, const ViewRenderer& renderer,
                  const fs::path& folder, ProgressSink& sink, TraceCounters& counters) {
  Progress progress(sink, "Rendering views", static_cast<long>(views.size()));
  std::mutex mutex;
  std::vector<std::string> blur(views.size());
  // Photos side by side, so that one is encoded while the next is traced.
  ParallelEach(views.size(), 1, [&](std::size_t i) {
    TraceCounters count;
    const RenderedView view = renderer.Render(views[i], count);
    const fs::path name = views[i].name;
    WriteImage(folder / "images" / name, view.photo, scene.jpeg_quality, views[i].orientation);
    WriteImage(folder / "truth" / "depth" / fs::path(name).replace_extension(".exr"), view.depth);
    WriteImage(folder / "truth" / "silhouettes" / fs::path(name).replace_extension(".png"), view.silhouette);
    const auto [low, median, high] = renderer.BlurPx(views[i], view.depth);
    blur[i] = fmt::format("{},{:.3f},{:.3f},{:.3f}\n", views[i].name, median, low, high);
    if (!view.moving.empty())
      WriteImage(folder / "truth" / "moving" / fs::path(name).replace_extension(".png"), view.moving);
    {
      const std::lock_guard lock(mutex);
      Add(counters, count);
    }
    progress.Step();
  });
  if (scene.effects.motion_blur_s)
    WriteTextAtomically(folder / "truth" / "blur.csv",
                        fmt::format("name,median_px,low_px,high_px\n{}", fmt::join(blur, "")));
}

// The photos as a video, in their order.
void WriteVideo(const std::vector<PlannedView>& views, double fps, const fs::path& folder, ProgressSink& sink) {
  Progress progress(sink, "Writing video.mp4", static_cast<long>(views.size()));
  VideoWriter video(folder / "video.mp4", fps);
  for (const PlannedView& view : views) {
    video.Add(ReadImage8(folder / "images" / view.name));
    progress.Step();
  }
  video.Finish();
}

// What is traced, and where counts and progress are reported.
struct Take {
  const TracedScene& traced;
  const SimulateOptions& options;
  ProgressSink& sink;
  TraceCounters& counters;
};

// The same scene by a camera that stands still; `number` tells its noise from other cameras'. Nothing, if it has no
// frames.
void WriteFixedVideo(const Take& take, const FixedVideoDescription& fixed, int number, const fs::path& file) {
  const int frames = take.options.fixed_frames >= 0 ? take.options.fixed_frames : fixed.frames;
  if (frames == 0) return;
  constexpr int kBatch = 32;  // traced side by side before they are encoded in turn
  const int first_index = 0x40000000 + 1000000 * number;
  SceneDescription scene = take.traced.scene;
  PathDescription path;
  path.kind = PathKind::kGiven;
  path.fps = scene.paths[0].fps;
  path.views = frames;
  path.cam_from_world.assign(static_cast<std::size_t>(frames),
                             LookAt(fixed.eye, fixed.target, Eigen::Vector3d::UnitZ()));
  scene.paths = {path};
  const ViewRenderer renderer(scene, take.traced.tracer, take.traced.shader, take.options.width_px, take.options.seed);
  Progress progress(take.sink, "Rendering " + file.filename().string(), frames);
  VideoWriter video(file, path.fps);
  std::mutex mutex;
  for (int first = 0; first < frames; first += kBatch) {
    std::vector<Image8> photos(static_cast<std::size_t>(std::min(kBatch, frames - first)));
    ParallelEach(photos.size(), 1, [&](std::size_t i) {
      PlannedView view;
      view.frame = first + static_cast<int>(i);
      view.frame_index = first_index + first + static_cast<int>(i);
      view.time_s = (fixed.start_frame + view.frame) / path.fps;
      TraceCounters count;
      photos[i] = renderer.Render(view, count).photo;
      const std::lock_guard lock(mutex);
      Add(take.counters, count);
    });
    for (const Image8& photo : photos) {
      video.Add(photo);
      progress.Step();
    }
  }
  video.Finish();
}

// The scene with the views of SimulateOptions::at_file in place of its path.
SceneDescription SceneAt(SceneDescription scene, const fs::path& file) {
  Json json;
  try {
    json = Json::parse(ReadJsonText(file));
  } catch (const Json::exception&) {
    throw InputError(file, "is no JSON",
                     "a camera path as lumi-render reads it is wanted: {\"keys\": [{\"time_s\": ...}]}");
  }
  const nlohmann::json plain(json);
  if (!plain.is_object()) throw InputError(file, "must be an object { ... }");
  JsonReader reader(plain, file, "");
  const Camera base = scene.cameras[0].camera;
  const int width = reader.Integer("width", 0, 0, 20000), height = reader.Integer("height", 0, 0, 20000);
  PathDescription path;
  path.kind = PathKind::kGiven;
  path.cameras.clear();
  scene.cameras.clear();
  for (const auto& [node, place] : reader.Array("keys")) {
    JsonReader key(*node, file, place);
    const auto q = key.Numbers("cam_from_world_xyzw", 4);
    const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
    if (!(rotation.norm() > 0)) key.Fail("cam_from_world_xyzw", "must be a rotation");
    Rigid3 pose;
    pose.rotation = rotation.normalized();
    pose.translation = -(pose.rotation * key.RequireVector3("position"));
    path.cam_from_world.push_back(pose);
    if (key.Has("phase")) {
      if (!scene.period_s) key.Fail("phase", "needs a scene with a period_s");
      path.times_s.push_back(key.RequireNumber("phase") * *scene.period_s);
    } else {
      path.times_s.push_back(key.RequireNumber("time_s"));
    }
    const double fov_rad = key.RequireNumber("vertical_fov_deg", JsonReader::Range::kPositive) * kRadPerDeg;
    if (fov_rad >= 179 * kRadPerDeg) key.Fail("vertical_fov_deg", "must be < 179");
    CameraDescription camera;
    camera.camera.model = CameraModel::kPinhole;
    camera.camera.width_px = width > 0 ? width : base.width_px;
    camera.camera.height_px = height > 0 ? height : base.height_px;
    const double focal_px = 0.5 * camera.camera.height_px / std::tan(0.5 * fov_rad);
    camera.camera.params = {focal_px, focal_px, 0.5 * camera.camera.width_px, 0.5 * camera.camera.height_px};
    const bool same = !scene.cameras.empty() && scene.cameras.back().camera.params == camera.camera.params;
    if (!same) scene.cameras.push_back(camera);
    path.cameras.push_back(static_cast<int>(scene.cameras.size()) - 1);
  }
  if (path.cam_from_world.empty()) throw InputError(file, "has no keys");
  path.views = static_cast<int>(path.cam_from_world.size());
  scene.paths = {path};
  scene.effects.noise_sigma.reset();
  scene.effects.exposure_stops.reset();
  scene.effects.white_balance_stops.reset();
  scene.effects.skew_px.reset();
  scene.jpeg = false;
  scene.fixed_video.reset();
  scene.videos.clear();
  return scene;
}

// The scene as filmed by a camera without shake, with a sensor read out at once and without noise.
SceneDescription Steady(SceneDescription scene) {
  for (PathDescription& path : scene.paths) path = WithShake(std::move(path), 0);
  scene.effects.rolling_shutter_s.reset();
  scene.effects.noise_sigma.reset();
  return scene;
}

// Of every `portrait_every` photos the second, as with motion blur.
void TurnToPortrait(std::vector<PlannedView>& views, int portrait_every, const SceneDescription& scene) {
  if (portrait_every == 0) return;
  if (!scene.jpeg) throw UsageError("--portrait-every: this scene's photos are PNG, which says nothing of it");
  if (scene.period_s) throw UsageError("--portrait-every: this scene is filmed");
  const auto every = static_cast<std::size_t>(portrait_every);
  for (std::size_t i = 1 % every; i < views.size(); i += every) views[i].orientation = kPortrait;
}

// The true surfaces, as the proxy to begin with.
void WriteTrueMesh(const Tracer& tracer, const fs::path& folder, Scene& truth) {
  const Mesh mesh = tracer.TrueMesh();
  if (mesh.faces.empty()) return;
  WriteMesh(folder / "truth" / "mesh.ply", mesh);
  WriteMesh(ProxyPath(folder, "truth"), mesh);
  truth.active_proxy = "truth";
  // Moving parts of the true mesh are where they are at time 0: nothing to blend other times over.
  if (tracer.HasMovingParts()) {
    Eigen::Vector3d towards = Eigen::Vector3d::Zero();
    for (const View& view : truth.views) towards -= view.cam_from_world.R().row(2).transpose();
    WriteMesh(ProxyPath(folder, "billboard"), tracer.BillboardMesh(towards.normalized()));
    truth.active_proxy = "billboard";
  }
}

// The old provenance and manifest are removed first, the new ones written last: a run that is killed in between leaves
// no capture, and the next run makes it anew.
void MoveIntoPlace(Staging& staging, const fs::path& output, Provenance& provenance) {
  staging.Begin();
  fs::remove(output / "provenance" / "simulate.json");
  fs::remove(output / "lumigraph.json");
  for (const fs::path name : {"images", "truth", "sparse", "proxies/truth.ply", "proxies/billboard.ply", "video.mp4",
                              "fixed.mp4", "videos", "lumigraph.json"}) {
    staging.MoveIntoPlace(name);
    if (!fs::exists(output / name)) continue;
    provenance.outputs[name.string()] = name == "lumigraph.json" ? kChangedLater : Fingerprint(output / name);
  }
}

}  // namespace

std::optional<std::string> Validate(const SimulateOptions& options) {
  if (options.scene_file.empty() == options.example.empty())
    return "give either a scene (SCENE.json) or --example NAME";
  if (options.output.empty()) return "say where the capture goes: -o CAPTURE";
  if (options.views < 0) return "--views must be >= 1";
  if (!options.at_file.empty() && options.views != 0)
    return "--at and --views do not go together: --at names its views";
  if (options.width_px < 0) return "--width must be >= 1";
  if (options.shake && !(*options.shake >= 0)) return "--shake must be >= 0";
  if (options.shake && options.steady) return "--shake and --steady do not go together";
  if (!options.at_file.empty() && (options.shake || options.steady || options.video))
    return "--at does not go with --shake, --steady and --video: it names its views";
  if (options.blur_s && !(*options.blur_s >= 0)) return "--blur-s must be >= 0";
  if (options.vignetting && !(*options.vignetting >= 0 && *options.vignetting <= 1))
    return "--vignetting must lie in [0, 1]";
  if (options.white_balance_stops && !(*options.white_balance_stops >= 0 && *options.white_balance_stops <= 4))
    return "--white-balance-stops must lie in [0, 4]";
  if (options.blur_every < 0) return "--blur-every must be >= 1";
  if (options.portrait_every < 0) return "--portrait-every must be >= 1";
  if (options.portrait_every > 0 && (options.video || !options.at_file.empty()))
    return "--portrait-every is for photos: it does not go with --video and --at";
  return std::nullopt;
}

// A capture made with other options, or of another scene, is somebody's data: it is replaced when that is asked for.
// (The same scene described otherwise is a next version of it.)
static void RequireReplaceable(const SimulateOptions& options, const Provenance& wanted) {
  const auto before = options.replace ? std::nullopt : ReadProvenance(options.output, wanted.stage);
  if (!before) return;
  std::string difference;
  for (const auto& [name, value] : wanted.options)
    if (const auto it = before->options.find(name); it == before->options.end() || it->second != value)
      difference += fmt::format("{}{} {}, not {}", difference.empty() ? "" : "; ", name,
                                it == before->options.end() ? "not given"
                                : it->second == "0"         ? "all"
                                                            : it->second,
                                value == "0" ? "all" : value);
  for (const auto& [name, value] : before->options)
    if (!wanted.options.contains(name))
      difference += fmt::format("{}{} {}", difference.empty() ? "" : "; ", name, value);
  const auto source = [](const Provenance& p) {
    std::set<std::string> names;
    for (const auto& [name, hash] : p.inputs) names.insert(name);
    return names;
  };
  if (difference.empty() && source(*before) != source(wanted)) difference = "another scene";
  if (difference.empty()) return;
  throw UsageError(
      fmt::format("{} holds a capture made otherwise ({}): nothing was touched", options.output.string(), difference),
      "choose another folder, or replace it: --replace");
}

SimulateSummary Simulate(const SimulateOptions& options, ProgressSink& progress) {
  if (const auto wrong = Validate(options)) throw UsageError(*wrong);
  const Stopwatch watch;
  const Source source = ReadSource(options);
  SceneDescription scene = ParseScene(source.text, source.name, source.folder);
  if (!options.at_file.empty()) scene = SceneAt(std::move(scene), options.at_file);
  if (options.shake) {
    if (std::ranges::none_of(scene.paths, [](const PathDescription& path) { return IsShaken(WithShake(path, 1)); }))
      throw UsageError("--shake: nothing shakes the camera on this scene's path",
                       "walk and drive can be shaken, and a wave with a hand");
    for (PathDescription& path : scene.paths) path = WithShake(std::move(path), *options.shake);
  }
  if (options.blur_s) scene.effects.motion_blur_s = *options.blur_s > 0 ? options.blur_s : std::nullopt;
  if (options.blur_every != 0) scene.effects.motion_blur_every = options.blur_every;
  if (options.blur_every != 0 && !scene.effects.motion_blur_s)
    throw UsageError("--blur-every: this scene has no motion blur", "give it an exposure time: --blur-s 0.08");
  const auto replace = [](const std::optional<double>& given, std::optional<double>& effect) {
    if (given) effect = *given > 0 ? given : std::nullopt;
  };
  replace(options.vignetting, scene.effects.vignetting);
  replace(options.white_balance_stops, scene.effects.white_balance_stops);
  const SceneDescription steady = Steady(scene);
  const bool shaken = std::ranges::any_of(scene.paths, IsShaken) && !options.steady;
  if (options.steady) scene = steady;
  std::vector<PlannedView> views = PlanViews(scene, options.views, options.video);
  TurnToPortrait(views, options.portrait_every, scene);

  const bool was_there = fs::exists(options.output);
  RequireOurFolder(options.output, fs::exists(options.output / kStaging) ? kStaging : "provenance/simulate.json");
  Provenance provenance = WantedProvenance(options, source, scene);

  RequireReplaceable(options, provenance);

  SimulateSummary summary;
  summary.scene = scene.name;
  summary.output = options.output;
  summary.views = static_cast<int>(views.size());
  summary.effects = EffectsOn(scene);
  const Camera& first = scene.cameras[static_cast<std::size_t>(views[0].camera)].camera;
  summary.width_px = options.width_px == 0 ? first.width_px : options.width_px;
  if (IsUpToDate(options.output, provenance)) {
    summary.reused = true;
    summary.height_px = ReadImageInfo(options.output / "images" / views[0].name).height;
    return summary;
  }

  try {
    const FolderLock lock(options.output);
    Staging staging(options.output);
    const fs::path& folder = staging.folder();
    const Tracer tracer(scene);
    const Shader shader(scene, tracer);
    // Those who ask for truth at some views also want to know where things move at all there.
    constexpr int kSweep = 64;
    const ViewRenderer renderer(scene, tracer, shader, options.width_px, options.seed,
                                options.at_file.empty() ? 0 : kSweep);
    summary.height_px = renderer.CameraOf(views[0]).camera.height_px;

    const TracedScene traced{scene, tracer, shader, renderer};
    const Take take{traced, options, progress, summary.counters};
    RenderPhotos(views, scene, renderer, folder, progress, summary.counters);
    Scene truth = TrueScene(scene, views, renderer);
    truth.image_folder = folder / "images";
    truth.period_s = scene.period_s;
    if ((scene.period_s || options.video) && options.at_file.empty()) {
      WriteVideo(views, scene.paths[0].fps, folder, progress);
      if (scene.fixed_video) WriteFixedVideo(take, *scene.fixed_video, 0, folder / "fixed.mp4");
    }
    for (std::size_t i = 0; i < scene.videos.size() && options.at_file.empty(); ++i)
      WriteFixedVideo(take, scene.videos[i], static_cast<int>(i),
                      folder / "videos" / fmt::format("camera_{:02d}.mp4", i));
    truth.points =
        SampleSurfacePoints(traced, views, PointCount(views.size()), options.seed, progress, summary.counters.rays);
    summary.points = static_cast<int>(truth.points.size());
    UpdateFrameOfReference(truth);
    truth.up = Eigen::Vector3d::UnitZ();
    WriteTrueMesh(tracer, folder, truth);
    const fs::path truth_folder = folder / "truth";
    WriteTextAtomically(truth_folder / "cameras.json", TrueCamerasJson(views, renderer));
    if (shaken)
      WriteTextAtomically(truth_folder / "steady.json",
                          TrueCamerasJson(views, ViewRenderer(steady, tracer, shader, options.width_px, options.seed)));
    WriteTextAtomically(truth_folder / "timestamps.csv", TimestampsCsv(views, renderer));
    WriteTextAtomically(truth_folder / "scene.json", source.text);
    // COLMAP's camera models have no skew: such a capture is photos and truth/cameras.json.
    if (!scene.effects.skew_px) {
      WriteColmapModel(truth, truth_folder / "sparse");
      WriteScene(truth, folder);
    }
    MoveIntoPlace(staging, options.output, provenance);
    provenance.seconds = summary.seconds = watch.Seconds();
    WriteProvenance(options.output, provenance);
    staging.End();
  } catch (...) {
    std::error_code ignored;
    if (!was_there) fs::remove(options.output, ignored);  // removes it only if it is empty
    throw;
  }
  return summary;
}

void ListKeys(JsonKeys& j, SimulateSummary& s) {
  j("scene", s.scene, "output", s.output, "views", s.views, "width", s.width_px, "height", s.height_px, "points",
    s.points, "seconds", s.seconds);
  j.Say("rays", s.counters.rays).Say("camera_poses", s.counters.poses).Say("noise_draws", s.counters.noise_draws);
  j("effects", s.effects, "reused", s.reused);
}

std::string Describe(const SimulateSummary& s) {
  const std::string output = s.output.string();
  if (s.reused) return output + " holds this capture already";
  return fmt::format("{} photos in {}/images, what is true about them in {}/truth", s.views, output, output);
}

}  // namespace lumi
