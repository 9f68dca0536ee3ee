// OpenGL without a window system: through EGL, on the first graphics device that works, else on the CPU (Mesa).
#pragma once

#include <memory>

namespace lumi {

class EglContext {
 public:
  // An OpenGL 4.3 core context, not yet current. Throws MachineError where the machine has none.
  EglContext();
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  // Current on the calling thread as long as the returned object lives; then as it was before. Throws MachineError.
  class Current {
   public:
    explicit Current(const EglContext& context);
    ~Current();
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;

   private:
    void *old_display_, *old_context_, *old_draw_, *old_read_;
    void* display_;
  };

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lumi
