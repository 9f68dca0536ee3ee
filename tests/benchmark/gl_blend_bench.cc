// What a frame costs on this machine's OpenGL, against the least that blending as many layers costs: a shader that does
// nothing but project, look up, weigh and add. Milliseconds are medians; the ratios are the figures.
//   gl_blend_bench                   frames from sparse samples, 1024x768
//   gl_blend_bench frames WxH        every way of weighing, at that size
//   gl_blend_bench device            what draws
#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "render/gl/egl_context.h"
#include "render/gl/gl_lumigraph.h"
#include "render/gl/photo_textures.h"
#include "scene/files/image_io.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr int kRepeats = 21;
constexpr int kPhotoWidth = 640, kPhotoHeight = 480;

// Medians of several things done in turn, so that whatever else the machine does meets all of them.
std::vector<double> MedianMs(const std::vector<std::function<void()>>& frames) {
  std::vector<std::vector<double>> ms(frames.size());
  for (int i = -2; i < kRepeats; ++i)
    for (std::size_t f = 0; f < frames.size(); ++f) {
      glFinish();
      const auto start = std::chrono::steady_clock::now();
      frames[f]();
      glFinish();
      const auto taken = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
      if (i >= 0) ms[f].push_back(taken);  // the first compile shaders
    }
  std::vector<double> medians;
  for (auto& of : ms) {
    std::nth_element(of.begin(), of.begin() + kRepeats / 2, of.end());
    medians.push_back(of[kRepeats / 2]);
  }
  return medians;
}

// Cameras on a bent grid before a textured plane.
struct World {
  Scene scene;
  Mesh proxy;
  std::vector<Photo> photos;
};
World MakeWorld(int views) {
  World w;
  w.proxy.vertices = {{-9, -7, 0}, {9, -7, 0}, {9, 7, 0}, {-9, 7, 0}};
  w.proxy.faces = {{0, 1, 2}, {0, 2, 3}};
  w.scene.cameras = {Camera::Pinhole(kPhotoWidth, kPhotoHeight, 500, 500, 320, 240)};
  const int columns = static_cast<int>(std::ceil(std::sqrt(views * 4.0 / 3)));
  const int rows = (views + columns - 1) / columns;
  for (int i = 0; i < views; ++i) {
    const double u = (i % columns + 0.5) / columns - 0.5, v = (i / columns + 0.5) / rows - 0.5;
    View view;
    view.name = fmt::format("{:05}.png", i);
    view.camera = CameraId{0};
    const Eigen::Vector3d eye(6 * u, 4 * v, 5 + 0.4 * std::sin(7.0 * i));
    view.cam_from_world = LookAt(eye, {4 * u, 3 * v, 0}, -Eigen::Vector3d::UnitY());
    w.scene.views.push_back(view);
    Image8 image(kPhotoWidth, kPhotoHeight, 3);
    for (std::size_t n = 0; n < image.data.size(); ++n)
      image.data[n] = static_cast<std::uint8_t>((n * 2654435761U) >> 13);
    w.photos.push_back({BuildPyramid(image), 0});
  }
  UpdateFrameOfReference(w.scene);
  return w;
}

// What 1024x768 pixels at a focal length of 900 pixels see, in height.
RenderView DesiredView(const Eigen::Vector2i& size_px) {
  const double f = 900.0 / 768 * size_px.y();
  return MakeRenderView(Camera::Pinhole(size_px.x(), size_px.y(), f, f, 0.5 * size_px.x(), 0.5 * size_px.y()),
                        LookAt({0.3, 0.2, 4.6}, {0.1, 0.1, 0}, -Eigen::Vector3d::UnitY()));
}

// Layers a pixel, on average over the picture.
double Layers(const SparsePlan& plan, const Eigen::Vector2i& size_px) {
  double sum = 0;
  for (const SparseTriangle& t : plan.triangles) {
    std::array<Eigen::Vector2d, 3> x;
    for (std::size_t i = 0; i < 3; ++i) x[i] = plan.x_px[static_cast<std::size_t>(t.vertex[i])].cast<double>();
    const Eigen::Vector2d a = x[1] - x[0], b = x[2] - x[0];
    sum += 0.5 * std::abs(a.x() * b.y() - a.y() * b.x()) * t.count;
  }
  return sum / size_px.cast<double>().prod();
}

// Nothing but the blending: homographies and weights in uniforms, one bilinear look-up a layer.
class BareBlend {
 public:
  explicit BareBlend(const World& world)
      : photos_(std::vector<Eigen::Vector2i>(world.photos.size(), Eigen::Vector2i(kPhotoWidth, kPhotoHeight))) {
    for (std::size_t i = 0; i < world.photos.size(); ++i) photos_.Upload(i, world.photos[i]);
    array_ = GlVertexArray::Make();
  }
  // A frame of this size that blends as the plan's middle triangle, by a fragment or a compute shader.
  std::function<void()> Frame(const ViewSetup& setup, const SparsePlan& plan, const Eigen::Vector2i& size_px,
                              GlTarget& target, int layers, bool compute = false) {
    const std::string begin = compute ? R"(layout(local_size_x = 8, local_size_y = 8) in;
layout(rgba32f, binding = 0) writeonly uniform image2D picture;
#define AT_PX (vec2(gl_GlobalInvocationID.xy) + 0.5)
#define SHOW(c) imageStore(picture, ivec2(gl_GlobalInvocationID.xy), c))"
                                      : R"(layout(location = 0) out vec4 color;
#define AT_PX gl_FragCoord.xy
#define SHOW(c) color = c)";
    const std::string text = fmt::format(R"(#version 430 core
{1}
uniform sampler2DArray photos;
uniform mat3 photo_from_pixel[{0}];
uniform float weights[{0}];
uniform float places[{0}];
void main() {{
  vec3 p = vec3(AT_PX, 1.0), mean = vec3(0.0);
  for (int i = 0; i < {0}; ++i) {{
    vec3 q = photo_from_pixel[i] * p;
    mean += weights[i] * textureLod(photos, vec3(q.xy / q.z, places[i]), 0.0).rgb;
  }}
  SHOW(vec4(mean, 1.0));
}}
)",
                                         layers, begin);
    program_ = compute ? GlProgram("bare", text) : GlProgram("bare", FullScreenVertexShader(), text);
    const GlProgram& program = program_;
    program.Use();
    std::vector<float> homographies, weights(static_cast<std::size_t>(layers), 1.0F / static_cast<float>(layers)),
        places;
    const SparseTriangle& middle = plan.triangles[plan.triangles.size() / 2];
    const RelativeSources& s = setup.sources;
    for (int i = 0; i < layers; ++i) {
      const auto j = static_cast<std::size_t>(plan.camera[static_cast<std::size_t>(middle.first + i % middle.count)]);
      Eigen::Matrix3f M;
      for (int r = 0; r < 9; ++r) M(r / 3, r % 3) = s.m[r][j];
      M.row(0) /= s.width_px[j];
      M.row(1) /= s.height_px[j];
      // Of a plane before the view at the proxy's distance.
      const float distance = plan.offset[plan.offset.size() / 2].norm();
      Eigen::Matrix3f at = Eigen::Matrix3f::Zero();
      at.col(2) = Eigen::Vector3f(s.dx[j], s.dy[j], s.dz[j]) / distance;
      const Eigen::Matrix3f H = M * (setup.ray_from_pixel.cast<float>() - at);
      homographies.insert(homographies.end(), H.data(), H.data() + 9);
      places.push_back(static_cast<float>(photos_.places()[j].layer));
    }
    glUniformMatrix3fv(program.Uniform("photo_from_pixel"), layers, GL_FALSE, homographies.data());
    glUniform1fv(program.Uniform("weights"), layers, weights.data());
    glUniform1fv(program.Uniform("places"), layers, places.data());
    glUniform1i(program.Uniform("photos"), 0);
    return [this, &target, size_px, compute] {
      photos_.Bind(0);
      if (compute) {
        program_.Use();
        glBindImageTexture(0, target.color_texture(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
        glDispatchCompute(static_cast<GLuint>(size_px.x() + 7) / 8, static_cast<GLuint>(size_px.y() + 7) / 8, 1);
        return;
      }
      glBindFramebuffer(GL_FRAMEBUFFER, target.color_framebuffer());
      glViewport(0, 0, size_px.x(), size_px.y());
      glDisable(GL_DEPTH_TEST);
      program_.Use();
      glBindVertexArray(array_.id());
      glDrawArrays(GL_TRIANGLES, 0, 3);
    };
  }

 private:
  PhotoTextures photos_;
  GlVertexArray array_;
  GlProgram program_;
};

class Drawing {
 public:
  Drawing(const World& world, const Eigen::Vector2i& size_px, const RadianceSettings& settings)
      : lumigraph_(MakeSources(world.scene),
                   std::vector<Eigen::Vector2i>(world.photos.size(), Eigen::Vector2i(kPhotoWidth, kPhotoHeight))),
        proxy_(world.proxy, world.scene.normalized_from_world) {
    lumigraph_.SetProxy(world.proxy);
    for (std::size_t i = 0; i < world.photos.size(); ++i) lumigraph_.Upload({static_cast<int>(i)}, world.photos[i]);
    request_.view = DesiredView(size_px);
    request_.settings = settings;
  }
  ViewSetup Setup() const { return MakeViewSetup(lumigraph_.sources(), request_.view, request_.settings); }
  const SparsePlan& Plan() {
    PlanSparse(Setup(), proxy_, nullptr, ParallelFor, plan_);
    return plan_;
  }
  // Planning, upload, drawing.
  void Frame() {
    lumigraph_.Begin(request_, target_);
    lumigraph_.Blend(target_, 0, size_px().y());
  }
  const Eigen::Vector2i& size_px() const { return request_.view.size_px; }
  GlLumigraph& lumigraph() { return lumigraph_; }
  void Begin() { lumigraph_.Begin(request_, target_); }
  void Read() { (void)lumigraph_.ReadColor(target_, size_px()); }
  GlTarget& target() { return target_; }

 private:
  GlLumigraph lumigraph_;
  const SparseProxy proxy_;
  SparsePlan plan_;
  GlTarget target_;
  RenderRequest request_;
};

RadianceSettings SparseSettings() {
  RadianceSettings settings;
  settings.grid_columns = settings.grid_rows = 25;
  settings.sampling = Sampling::kInterpolated;
  settings.visibility = false;
  return settings;
}

void SparseSamples() {
  const Eigen::Vector2i size(1024, 768);
  fmt::print(
      "\n## Sparse samples in OpenGL\n\n{}, {} threads, {}x{}, 25x25 samples, a plane. Bare: a shader that only blends "
      "as many layers.\n\n| photos | k | prefilter | field of view | layers | frame ms | of it planning ms | bare ms | "
      "ratio |\n|---|---|---|---|---|---|---|---|---|\n",
      GlDeviceName(), ThreadCount(), size.x(), size.y());
  RadianceSettings settings = SparseSettings();
  const World few = MakeWorld(50), many = MakeWorld(262);
  for (const bool prefilter : {false, true})
    for (const bool field_of_view : {false, true}) {
      settings.prefilter = prefilter;
      settings.field_of_view = field_of_view;
      Drawing drawing(few, size, settings);
      BareBlend bare(few);
      const SparsePlan plan = drawing.Plan();
      const double layers = Layers(plan, size);
      const auto ms =
          MedianMs({[&] { drawing.Frame(); },
                    bare.Frame(drawing.Setup(), plan, size, drawing.target(), static_cast<int>(std::lround(layers))),
                    [&] { drawing.Plan(); }});
      fmt::print("| 50 | 4 | {} | {} | {:.1f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} |\n", prefilter ? "on" : "off",
                 field_of_view ? "on" : "off", layers, ms[0], ms[2], ms[1], ms[0] / ms[1]);
    }
  settings.field_of_view = true;
  {
    RadianceSettings candidates = settings, pixel = settings;
    candidates.sampling = Sampling::kCandidates;
    pixel.grid_columns = pixel.grid_rows = 0;
    Drawing a(few, size, settings), b(few, size, candidates), c(few, size, pixel);
    const auto ms = MedianMs({[&] { a.Frame(); }, [&] { b.Frame(); }, [&] { c.Frame(); }});
    fmt::print(
        "\n## Weights in OpenGL\n\n50 photos, k = 4.\n\n| interpolated ms | candidates ms | ratio | all photos at "
        "every "
        "pixel ms | ratio |\n|---|---|---|---|---|\n| {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} |\n",
        ms[0], ms[1], ms[1] / ms[0], ms[2], ms[2] / ms[0]);
  }
  settings.k = 5;
  Drawing a(few, size, settings), b(many, size, settings);
  const auto ms = MedianMs({[&] { a.Frame(); }, [&] { b.Frame(); }, [&] { a.Plan(); }, [&] { b.Plan(); }});
  fmt::print(
      "\n## Sparse samples in OpenGL by the number of photos\n\nk = 5.\n\n| photos | frame ms | planning ms | layers | "
      "ratio |\n|---|---|---|---|---|\n| 50 | {:.2f} | {:.2f} | {:.1f} | |\n| 262 | {:.2f} | {:.2f} | {:.1f} | {:.2f} "
      "|\n",
      ms[0], ms[2], Layers(a.Plan(), size), ms[1], ms[3], Layers(b.Plan(), size), ms[1] / ms[0]);
}

// Every way of weighing that OpenGL has, with the planning that each needs on the CPU.
void Frames(const Eigen::Vector2i& size) {
  fmt::print(
      "\n## Frames of {}x{} in OpenGL\n\n{}, {} threads. Photos of {}x{} before a plane, k = 4; sparse: 25x25 samples. "
      "First: planning on the CPU, the proxy's depth, the photos of each tile. Bare: a shader of that kind that only "
      "blends 4 layers. Nothing is read back.\n\n| photos | how | shader | frame ms | of it first ms | frames a second "
      "| "
      "bare ms | ratio |\n|---|---|---|---|---|---|---|---|\n",
      size.x(), size.y(), GlDeviceName(), ThreadCount(), kPhotoWidth, kPhotoHeight);
  RadianceSettings interpolated = SparseSettings(), candidates = interpolated, optimum = interpolated,
                   pixel = interpolated;
  candidates.sampling = Sampling::kCandidates;
  optimum.similarity = Similarity::kFull;
  optimum.correlation = Correlation::kFallingLeaves;
  pixel.grid_columns = pixel.grid_rows = 0;
  struct Way {
    const char* how;
    const RadianceSettings* settings;
    bool compute;
  };
  double read_ms = 0;
  for (const int photos : {50, 262}) {
    const World world = MakeWorld(photos);
    for (const Way& way : {Way{"interpolated weights", &interpolated, false},
                           {"optimum on samples", &optimum, false},
                           {"candidates", &candidates, false},
                           {"candidates", &candidates, true},
                           {"all photos at every pixel", &pixel, false},
                           {"all photos at every pixel", &pixel, true}}) {
      Drawing drawing(world, size, *way.settings), plain(world, size, interpolated);
      drawing.lumigraph().SetComputing(way.compute);
      BareBlend bare(world);
      plain.Frame();  // makes its target
      const SparsePlan plan = plain.Plan();
      const auto ms =
          MedianMs({[&] { drawing.Frame(); }, bare.Frame(plain.Setup(), plan, size, plain.target(), 4, way.compute),
                    [&] { drawing.Begin(); }});
      fmt::print("| {} | {} | {} | {:.2f} | {:.2f} | {:.0f} | {:.2f} | {:.1f} |\n", photos, way.how,
                 way.compute ? "compute" : "fragment", ms[0], ms[2], 1000 / ms[0], ms[1], ms[0] / ms[1]);
      if (read_ms == 0) read_ms = MedianMs({[&] { drawing.Read(); }})[0];
    }
  }
  fmt::print("\nReading a picture back, four floats a pixel, takes {:.1f} ms.\n", read_ms);
}

int Run(const std::vector<std::string>& arguments) {
  const EglContext context;
  const EglContext::Current current(context);
  int width = 0, height = 0;
  if (arguments.empty()) {
    SparseSamples();
  } else if (arguments == std::vector<std::string>{"device"}) {
    fmt::print("{}\n", GlDeviceName());
  } else if (arguments.size() == 2 && arguments[0] == "frames" &&
             std::sscanf(arguments[1].c_str(), "%dx%d", &width, &height) == 2 && width > 0 && height > 0) {
    Frames({width, height});
  } else {
    fmt::print(stderr, "gl_blend_bench [frames WxH | device]\n");
    return 2;
  }
  return 0;
}

}  // namespace
}  // namespace lumi

int main(int argc, char** argv) { return lumi::Run({argv + 1, argv + argc}); }
