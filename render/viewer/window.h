// The viewer's window: GLFW with an OpenGL 4.3 core context and Dear ImGui in it, and what the user did in it.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

struct GLFWwindow;

namespace lumi {

// What happened since the last Take, as far as the panel did not take it. Pixels are of the framebuffer.
struct WindowInput {
  Eigen::Vector2d orbit_px = Eigen::Vector2d::Zero();   // drags: left button
  Eigen::Vector2d look_px = Eigen::Vector2d::Zero();    // right button
  Eigen::Vector2d pan_px = Eigen::Vector2d::Zero();     // middle button, or left with Shift
  bool drag_began = false;                              // of left or middle
  double dolly_steps = 0;                               // wheel
  double zoom_steps = 0;                                // wheel with Ctrl
  std::optional<Eigen::Vector2d> double_click_px;       // from the top left
  Eigen::Vector2d cursor_px = Eigen::Vector2d::Zero();  // from the top left
  std::filesystem::path dropped;                        // a file or folder that was dropped on the window
  std::vector<int> keys;                                // GLFW key codes, pressed or repeated
  Eigen::Vector3d fly = Eigen::Vector3d::Zero();        // held keys: right, up, forward, each -1 to 1 (4 with Shift)
};

class Window {
 public:
  // Throws MachineError where there is no display or no OpenGL 4.3. One window a process.
  Window(const std::string& title, int width_px, int height_px);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  bool ShouldClose() const;
  void Close();
  // Handles events; waits up to wait_s for one (0: does not wait).
  void Poll(double wait_s);
  WindowInput Take();
  bool Dragging() const;  // a button is held in the picture
  Eigen::Vector2i FramebufferSize() const;
  Eigen::Vector2i Size() const;  // as the constructor takes it
  float ContentScale() const;

  void BeginUi();       // starts a frame of Dear ImGui
  void EndUi();         // ends it; nothing is drawn yet
  void DrawUi() const;  // into the framebuffer that is bound
  void Swap();

 private:
  struct Events;
  GLFWwindow* window_ = nullptr;
  Events* events_ = nullptr;
};

}  // namespace lumi
