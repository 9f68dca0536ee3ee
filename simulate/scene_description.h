// What a scene to be simulated is: cameras, a path, objects with materials, light, and the effects that are asked for.
// Read from JSON (docs/simulate.md describes every key). World: z up, metres by custom.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/geometry/rigid3.h"
#include "scene/model/camera.h"

namespace lumi {

// Linear light, 0..1 for what a photo can show. JSON gives code values (0..1 or "#rrggbb"); see photo_response.h.
using Rgb = Eigen::Vector3f;

struct CameraDescription {
  std::string name;
  Camera camera;
};

enum class PathKind { kRing, kGrid, kWalk, kDrive, kWave, kClusters, kPoses, kGiven };

struct PathDescription {
  PathKind kind = PathKind::kRing;
  int views = 1;
  double fps = 1;                  // view i is taken at i / fps seconds
  std::vector<int> cameras = {0};  // view i uses cameras[i % size]
  std::optional<Eigen::Vector3d> look_at;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitY();                           // where there is no look_at
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();                               // ring, grid, wave
  double radius = 1, height = 0, start_rad = 0, arc_rad = 0;                      // ring; height above centre
  int columns = 1, rows = 1;                                                      // grid
  Eigen::Vector2d spacing = {0.1, 0.1};                                           // grid: right and up
  Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::UnitY();  // walk, drive
  // Gait, of walk and, where asked for, drive: steps, their reach in world units, tremor of the direction.
  bool gait = false;
  double step_hz = 1.9, bob = 0.03, sway = 0.025, shake_rad = 0.012;
  double pace_s = 0;                          // gait: by how much it is ahead or behind
  double zoom_error = 0;                      // gait: share of the focal length
  std::optional<Eigen::Vector3d> hold;        // zooms so that the size of what is there stays as in the first view
  Eigen::Vector2d zoom = {1, 1};              // of the focal length at the path's beginning and end
  double weave = 0;                           // drive: sideways, world units
  Eigen::Vector3d amplitude = {0.1, 0, 0.1};  // wave
  double period_s = 4;                        // wave
  double hand_drift = 0, hand_rad = 0;   // wave: a hand's irregularity of place (world units) and direction, amplitudes
  std::vector<Eigen::Vector3d> centres;  // clusters: their eyes' centres
  double spread = 0.1;                   // clusters: radius about each centre
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> poses;  // poses: eye, target
  std::vector<Rigid3> cam_from_world;  // given (not from JSON): a pose and a time for each view
  std::vector<double> times_s;
};

enum class TextureKind { kConstant, kNoise, kCells, kBricks, kTiles, kStripes, kWood, kGlyphs, kImage, kChecker };

struct TextureDescription {
  TextureKind kind = TextureKind::kConstant;
  std::vector<Rgb> colors = {Rgb(0.5f, 0.5f, 0.5f)};
  Eigen::Vector2d size = {0.1, 0.1};  // of one feature, world units (image: of the whole picture)
  int octaves = 5;                    // noise
  double gain = 0.55;                 // noise: strength of an octave over the one before
  double contrast = 1;                // noise
  int bands = 0;                      // noise: so many flat colours with sharp edges; 0: smooth
  double joint = 0.06;                // cells, bricks, tiles: width of the joint as a share of the feature
  Rgb joint_color = Rgb(0.1f, 0.1f, 0.1f);
  double variation = 0.15;     // from one feature to the next, share of brightness
  double grain = 0;            // fine noise on top, share of brightness
  double grain_size = 0.01;    // world units
  std::filesystem::path file;  // image
  std::uint32_t seed = 0;
};

struct MaterialDescription {
  std::string name;
  TextureDescription texture;
  bool lit = true;        // false: shines by itself with its texture's colour
  double specular = 0;    // strength of the highlight (Blinn-Phong, normalised to 1 at its peak)
  double shininess = 60;  // exponent of the highlight
  double mirror = 0;      // share of the mirrored surroundings at normal incidence (Schlick towards grazing)
  double roughness = 0;   // radius of the mirrored directions' cone, radians
};

struct SpinDescription {                             // a moving part: rotation about an axis
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();   // unit, world
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // a point on the axis, world
  double period_s = 1;
  double unsteady = 0;  // 0 to 1: by how much of itself the speed wavers, never the same way twice
  bool operator==(const SpinDescription&) const = default;
};

enum class ShapeKind { kQuad, kBox, kSphere, kCylinder, kTube, kHeightfield, kLoft, kMesh };

struct LoftSection {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector2d half_size = {1, 1};  // across and along the loft's `up`
};

struct ObjectDescription {
  std::string name;
  ShapeKind kind = ShapeKind::kQuad;
  std::vector<int> materials = {0};  // one; a tube may have four: floor, left, ceiling, right
  bool foreground = true;            // white in the silhouettes
  std::optional<SpinDescription> spin;
  Eigen::Affine3d world_from_object = Eigen::Affine3d::Identity();
  Eigen::Vector3d size = {1, 1, 1};  // quad: x, y; box: x, y, z; tube: x, y (length), z; heightfield: x, y, amplitude
  double radius = 1, top_radius = 1, height = 1;  // sphere; cylinder
  int segments = 96;                              // around spheres, cylinders, lofts
  double wavelength = 1;                          // heightfield: size of its hills
  std::vector<LoftSection> sections;              // loft
  double squareness = 2;                          // loft: exponent of the superellipse, 2 = ellipse
  Eigen::Vector3d loft_up = Eigen::Vector3d::UnitZ();
  std::filesystem::path file;  // mesh
};

struct LightDescription {
  bool directional = true;
  Eigen::Vector3d towards = Eigen::Vector3d::UnitZ();  // directional: unit vector to the light; else its position
  Rgb color = Rgb(1, 1, 1);
  double reach = 0;     // position: distance at which it has half its strength; 0: no falloff
  double size_rad = 0;  // directional: radius of its disk, softens shadows
  bool shadows = true;
};

enum class BackgroundKind { kColor, kGradient, kTexture };

struct BackgroundDescription {
  BackgroundKind kind = BackgroundKind::kColor;
  Rgb horizon = Rgb(0, 0, 0), zenith = Rgb(0, 0, 0), ground = Rgb(0, 0, 0);  // colour: horizon
  TextureDescription texture;  // over unit directions; its size is in radians
};

// A camera on a tripod that films the same scene: fixed.mp4 of a capture, or one of several in videos/.
struct FixedVideoDescription {
  Eigen::Vector3d eye = Eigen::Vector3d::Zero(), target = Eigen::Vector3d::UnitY();
  int frames = 0;
  int start_frame = 0;  // of the scene's clock, at which its own begins
};

// Every effect is off unless the scene asks for it.
struct EffectsDescription {
  std::optional<double> skew_px;
  std::optional<double> noise_sigma;        // code values of 255
  std::optional<double> motion_blur_s;      // exposure time
  int motion_blur_every = 1;                // of every so many photos the second is blurred; 1: all are
  std::optional<double> rolling_shutter_s;  // from the first row to the last
  std::optional<double> exposure_stops;     // drift: amplitude
  double exposure_period_s = 10;
  std::optional<double> white_balance_stops;  // drift: amplitude, of red up and of blue down
  double white_balance_period_s = 10;
  std::optional<double> vignetting;  // share of the light lost in the corners
};

struct SceneDescription {
  std::string name;
  std::vector<CameraDescription> cameras;
  std::vector<PathDescription> paths;
  // The scene repeats itself after this time. Its capture is a video, and fewer views are its first frames.
  std::optional<double> period_s;
  std::optional<FixedVideoDescription> fixed_video;
  std::vector<FixedVideoDescription> videos;  // several cameras at once: videos/camera_00.mp4 ...
  std::vector<MaterialDescription> materials;
  std::vector<ObjectDescription> objects;
  std::vector<LightDescription> lights;
  Rgb ambient_sky = Rgb(0.4f, 0.4f, 0.4f), ambient_ground = Rgb(0.3f, 0.3f, 0.3f);
  BackgroundDescription background;
  std::optional<BackgroundDescription> environment;  // what mirrors show in the background's place
  EffectsDescription effects;
  int samples_per_pixel = 4;  // a square number
  bool jpeg = true;
  int jpeg_quality = 95;
  std::vector<std::filesystem::path> files;  // pictures and meshes it reads
};

// `name` is the file (or example) that messages name; relative paths inside are taken from `folder`. Throws InputError:
// "objects[3].radius: must be > 0".
SceneDescription ParseScene(const std::string& json_text, const std::filesystem::path& name,
                            const std::filesystem::path& folder);

// Names of the effects that a scene asks for, in a fixed order.
std::vector<std::string> EffectsOn(const SceneDescription& scene);

}  // namespace lumi
