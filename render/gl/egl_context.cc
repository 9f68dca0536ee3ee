#include "render/gl/egl_context.h"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <fmt/format.h>

#include <cstring>
#include <string>
#include <vector>

#include "render/gl/gl_objects.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr const char* kHint = "use --backend cpu, or install libegl1 and libgl1-mesa-dri";

bool Has(const char* extensions, const char* wanted) {
  if (extensions == nullptr) return false;
  const std::size_t n = std::strlen(wanted);
  for (const char* p = std::strstr(extensions, wanted); p != nullptr; p = std::strstr(p + n, wanted))
    if ((p == extensions || p[-1] == ' ') && (p[n] == 0 || p[n] == ' ')) return true;
  return false;
}

}  // namespace

struct EglContext::Impl {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  EGLSurface surface = EGL_NO_SURFACE;  // 1x1, where the display needs one

  // Whether `candidate` gives a context; if not, the display is left as it was.
  bool Try(EGLDisplay candidate, std::string& why) {
    if (candidate == EGL_NO_DISPLAY || !eglInitialize(candidate, nullptr, nullptr)) {
      why = "no EGL display could be initialised";
      return false;
    }
    const char* extensions = eglQueryString(candidate, EGL_EXTENSIONS);
    const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (!eglBindAPI(EGL_OPENGL_API) || !eglChooseConfig(candidate, wanted, &config, 1, &count)) count = 0;
    if (count == 0) {
      if (!Has(extensions, "EGL_KHR_no_config_context")) {
        why = "EGL has no OpenGL configuration";
        return false;
      }
      config = EGL_NO_CONFIG_KHR;
    }
    const EGLint attributes[] = {
        EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    const EGLContext made = eglCreateContext(candidate, config, EGL_NO_CONTEXT, attributes);
    if (made == EGL_NO_CONTEXT) {
      why = "no OpenGL 4.3 core context could be made";
      return false;
    }
    EGLSurface pixel = EGL_NO_SURFACE;
    if (!Has(extensions, "EGL_KHR_surfaceless_context")) {
      const EGLint size[] = {EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE};
      pixel = eglCreatePbufferSurface(candidate, config, size);
    }
    if (!eglMakeCurrent(candidate, pixel, pixel, made)) {
      why = "the OpenGL context could not be made current";
      if (pixel != EGL_NO_SURFACE) eglDestroySurface(candidate, pixel);
      eglDestroyContext(candidate, made);
      return false;
    }
    eglMakeCurrent(candidate, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    display = candidate;
    context = made;
    surface = pixel;
    return true;
  }
};

EglContext::EglContext() : impl_(std::make_unique<Impl>()) {
  // libepoxy ends the program where a library or a function is missing: ask before every call.
  void* library = dlopen("libEGL.so.1", RTLD_LAZY);
  if (library == nullptr) throw MachineError("no OpenGL: libEGL.so.1 is not installed", kHint);
  dlclose(library);

  const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const bool platforms = Has(client, "EGL_EXT_platform_base");
  std::string why = "EGL offers no platform";
  if (platforms && Has(client, "EGL_EXT_platform_device") &&
      (Has(client, "EGL_EXT_device_base") || Has(client, "EGL_EXT_device_enumeration"))) {
    std::vector<EGLDeviceEXT> devices(64);
    EGLint count = 0;
    if (eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count))
      for (EGLint i = 0; i < count; ++i) {
        EGLDeviceEXT device = devices[static_cast<std::size_t>(i)];
        const char* about = Has(client, "EGL_EXT_device_base") || Has(client, "EGL_EXT_device_query")
                                ? eglQueryDeviceStringEXT(device, EGL_EXTENSIONS)
                                : nullptr;
        if (Has(about, "EGL_MESA_device_software")) continue;  // Mesa's surfaceless platform below is the same
        if (impl_->Try(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr), why)) return;
      }
  }
  if (platforms && Has(client, "EGL_MESA_platform_surfaceless") &&
      impl_->Try(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr), why))
    return;
  if (impl_->Try(eglGetDisplay(EGL_DEFAULT_DISPLAY), why)) return;
  throw MachineError("no OpenGL 4.3 on this machine: " + why, kHint);
}

EglContext::~EglContext() {
  if (!CanTearDownGl()) return;
  if (impl_->surface != EGL_NO_SURFACE) eglDestroySurface(impl_->display, impl_->surface);
  if (impl_->context != EGL_NO_CONTEXT) eglDestroyContext(impl_->display, impl_->context);
  // The display stays initialised: a process has only one, and another context may use it.
}

EglContext::Current::Current(const EglContext& context)
    : old_display_(eglGetCurrentDisplay()),
      old_context_(eglGetCurrentContext()),
      old_draw_(eglGetCurrentSurface(EGL_DRAW)),
      old_read_(eglGetCurrentSurface(EGL_READ)),
      display_(context.impl_->display) {
  eglBindAPI(EGL_OPENGL_API);
  if (!eglMakeCurrent(context.impl_->display, context.impl_->surface, context.impl_->surface, context.impl_->context))
    throw MachineError("the OpenGL context could not be made current on this thread", kHint);
}

EglContext::Current::~Current() {
  if (!CanTearDownGl()) return;
  if (old_display_ != EGL_NO_DISPLAY && old_context_ != EGL_NO_CONTEXT)
    eglMakeCurrent(old_display_, old_draw_, old_read_, old_context_);
  else
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

}  // namespace lumi
