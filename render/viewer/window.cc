#include "render/viewer/window.h"

#include <epoxy/gl.h>

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "render/gl/gl_objects.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kDoubleClick_s = 0.35;
constexpr double kClickRadius_px = 4;
constexpr const char* kHint = "start it in a desktop session, under xvfb-run, or make pictures with lumi-render";

std::string GlfwProblem() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text != nullptr ? std::string(text) : "unknown reason";
}

void ApplyStyle(float scale) {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 6;
  style.FrameRounding = 4;
  style.GrabRounding = 4;
  style.PopupRounding = 4;
  style.WindowBorderSize = 0;
  style.WindowPadding = {12, 10};
  style.ItemSpacing = {8, 6};
  style.Colors[ImGuiCol_WindowBg] = {0.09F, 0.095F, 0.11F, 0.93F};
  style.Colors[ImGuiCol_FrameBg] = {0.21F, 0.225F, 0.25F, 1};
  style.Colors[ImGuiCol_FrameBgHovered] = {0.22F, 0.24F, 0.27F, 1};
  style.Colors[ImGuiCol_FrameBgActive] = {0.25F, 0.28F, 0.32F, 1};
  style.Colors[ImGuiCol_Button] = {0.19F, 0.21F, 0.24F, 1};
  style.Colors[ImGuiCol_ButtonHovered] = {0.26F, 0.31F, 0.38F, 1};
  style.Colors[ImGuiCol_ButtonActive] = {0.25F, 0.42F, 0.60F, 1};
  style.Colors[ImGuiCol_Header] = {0.22F, 0.30F, 0.39F, 1};
  style.Colors[ImGuiCol_HeaderHovered] = {0.26F, 0.37F, 0.49F, 1};
  style.Colors[ImGuiCol_SliderGrab] = {0.36F, 0.61F, 0.86F, 1};
  style.Colors[ImGuiCol_SliderGrabActive] = {0.47F, 0.71F, 0.95F, 1};
  style.Colors[ImGuiCol_CheckMark] = {0.47F, 0.71F, 0.95F, 1};
  style.Colors[ImGuiCol_PlotHistogram] = {0.36F, 0.61F, 0.86F, 1};
  style.Colors[ImGuiCol_Separator] = {0.24F, 0.25F, 0.28F, 1};
  style.ScaleAllSizes(scale);
  ImGui::GetIO().FontGlobalScale = scale;
}

}  // namespace

struct Window::Events {
  enum class Drag { kNone, kOrbit, kLook, kPan };
  WindowInput input;
  Drag drag = Drag::kNone;
  Eigen::Vector2d cursor = Eigen::Vector2d::Zero();  // window coordinates
  double last_click_s = -1;
  Eigen::Vector2d last_click = Eigen::Vector2d::Zero();

  static Events& Of(GLFWwindow* w) { return *static_cast<Events*>(glfwGetWindowUserPointer(w)); }

  // Framebuffer pixels a window coordinate: not 1 on some displays.
  static Eigen::Vector2d Density(GLFWwindow* w) {
    int fw = 1, fh = 1, ww = 1, wh = 1;
    glfwGetFramebufferSize(w, &fw, &fh);
    glfwGetWindowSize(w, &ww, &wh);
    return {static_cast<double>(fw) / std::max(ww, 1), static_cast<double>(fh) / std::max(wh, 1)};
  }

  static void Button(GLFWwindow* w, int button, int action, int mods) {
    Events& e = Of(w);
    if (action == GLFW_RELEASE) {
      e.drag = Drag::kNone;
      return;
    }
    if (ImGui::GetIO().WantCaptureMouse) return;
    if (button == GLFW_MOUSE_BUTTON_RIGHT) {
      e.drag = Drag::kLook;
    } else {
      e.drag = button == GLFW_MOUSE_BUTTON_MIDDLE || (mods & GLFW_MOD_SHIFT) != 0 ? Drag::kPan : Drag::kOrbit;
      e.input.drag_began = true;
    }
    if (button == GLFW_MOUSE_BUTTON_LEFT) {
      const double now = glfwGetTime();
      if (now - e.last_click_s < kDoubleClick_s && (e.cursor - e.last_click).norm() < kClickRadius_px) {
        e.input.double_click_px = e.cursor.cwiseProduct(Density(w));
        e.last_click_s = -1;
      } else {
        e.last_click_s = now;
        e.last_click = e.cursor;
      }
    }
  }

  static void Cursor(GLFWwindow* w, double x, double y) {
    Events& e = Of(w);
    const Eigen::Vector2d now(x, y), step = (now - e.cursor).cwiseProduct(Density(w));
    e.cursor = now;
    if (e.drag == Drag::kOrbit) e.input.orbit_px += step;
    if (e.drag == Drag::kLook) e.input.look_px += step;
    if (e.drag == Drag::kPan) e.input.pan_px += step;
  }

  static void Scroll(GLFWwindow* w, double, double steps) {
    if (ImGui::GetIO().WantCaptureMouse) return;
    const bool ctrl =
        glfwGetKey(w, GLFW_KEY_LEFT_CONTROL) == GLFW_PRESS || glfwGetKey(w, GLFW_KEY_RIGHT_CONTROL) == GLFW_PRESS;
    (ctrl ? Of(w).input.zoom_steps : Of(w).input.dolly_steps) += steps;
  }

  static void Key(GLFWwindow* w, int key, int, int action, int mods) {
    if (action == GLFW_RELEASE || ImGui::GetIO().WantTextInput || (mods & (GLFW_MOD_CONTROL | GLFW_MOD_ALT)) != 0)
      return;
    Of(w).input.keys.push_back(key);
  }

  static void Drop(GLFWwindow* w, int count, const char** paths) {
    if (count > 0) Of(w).input.dropped = paths[0];
  }
};

Window::Window(const std::string& title, int width_px, int height_px) {
  if (!glfwInit()) throw MachineError("no window can be opened: " + GlfwProblem(), kHint);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  glfwWindowHint(GLFW_DEPTH_BITS, 0);
  window_ = glfwCreateWindow(width_px, height_px, title.c_str(), nullptr, nullptr);
  if (window_ == nullptr) {
    const std::string why = GlfwProblem();
    glfwTerminate();
    throw MachineError("no window with OpenGL 4.3 can be opened: " + why, kHint);
  }
  glfwMakeContextCurrent(window_);
  glfwSwapInterval(1);
  events_ = new Events;
  glfwSetWindowUserPointer(window_, events_);
  glfwGetCursorPos(window_, &events_->cursor.x(), &events_->cursor.y());
  // Dear ImGui calls these on from its own.
  glfwSetMouseButtonCallback(window_, Events::Button);
  glfwSetCursorPosCallback(window_, Events::Cursor);
  glfwSetScrollCallback(window_, Events::Scroll);
  glfwSetKeyCallback(window_, Events::Key);
  glfwSetDropCallback(window_, Events::Drop);
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // nothing is written into the user's folder
  ImGui_ImplGlfw_InitForOpenGL(window_, true);
  ImGui_ImplOpenGL3_Init("#version 430 core");
  ApplyStyle(ContentScale());
  RequireGl43();
}

Window::~Window() {
  if (!CanTearDownGl()) return;
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  glfwDestroyWindow(window_);
  glfwTerminate();
  delete events_;
}

bool Window::ShouldClose() const { return glfwWindowShouldClose(window_) != 0; }
void Window::Close() { glfwSetWindowShouldClose(window_, GLFW_TRUE); }

void Window::Poll(double wait_s) {
  if (wait_s > 0)
    glfwWaitEventsTimeout(wait_s);
  else
    glfwPollEvents();
}

WindowInput Window::Take() {
  WindowInput taken = std::exchange(events_->input, {});
  taken.cursor_px = events_->cursor.cwiseProduct(Events::Density(window_));
  if (!ImGui::GetIO().WantTextInput) {
    const auto held = [this](int key) { return glfwGetKey(window_, key) == GLFW_PRESS ? 1.0 : 0.0; };
    const double speed = held(GLFW_KEY_LEFT_SHIFT) + held(GLFW_KEY_RIGHT_SHIFT) > 0 ? 4 : 1;
    taken.fly = speed * Eigen::Vector3d(held(GLFW_KEY_D) - held(GLFW_KEY_A), held(GLFW_KEY_E) - held(GLFW_KEY_Q),
                                        held(GLFW_KEY_W) - held(GLFW_KEY_S));
  }
  return taken;
}

bool Window::Dragging() const { return events_->drag != Events::Drag::kNone; }

Eigen::Vector2i Window::FramebufferSize() const {
  Eigen::Vector2i size;
  glfwGetFramebufferSize(window_, &size.x(), &size.y());
  return size;
}

Eigen::Vector2i Window::Size() const {
  Eigen::Vector2i size;
  glfwGetWindowSize(window_, &size.x(), &size.y());
  return size;
}

float Window::ContentScale() const {
  float x = 1, y = 1;
  glfwGetWindowContentScale(window_, &x, &y);
  return std::clamp(std::max(x, y), 1.0F, 4.0F);
}

void Window::BeginUi() {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
}
void Window::EndUi() { ImGui::Render(); }
void Window::DrawUi() const { ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData()); }
void Window::Swap() { glfwSwapBuffers(window_); }

}  // namespace lumi
