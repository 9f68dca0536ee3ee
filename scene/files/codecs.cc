#include "scene/files/codecs.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include "scene/files/video_codecs.h"
#include "scene/program/error.h"
#include "scene/program/installation.h"
#include "scene/program/out_of_memory.h"

namespace lumi {
namespace {

void* OpenModule(const char* file, const char* symbol, const char* what) {
  // With the suite, wherever that was put; else where the system looks.
  const std::optional<std::filesystem::path> own = FindOfSuite(file);
  void* module = nullptr;
  {
    // Static objects of the libraries behind it start threads (log4cplus, behind OpenCV's codecs): an exception out of
    // them waits for these threads, which wait for the loader.
    const EndsWhereMemoryRunsOut no_way_back;
    module = ::dlopen(own ? own->c_str() : file, RTLD_LAZY | RTLD_LOCAL);
  }
  const char* why = module ? nullptr : ::dlerror();
  const std::string said = why ? why : "";
  void* found = module ? ::dlsym(module, symbol) : nullptr;
  if (!found)
    throw MachineError(fmt::format("{} cannot be read: {} cannot be loaded ({})", what, file, said),
                       "it belongs beside the programs: was it moved?");
  return found;
}

}  // namespace

const Codecs& LoadCodecs() {
  static const Codecs* codecs =
      reinterpret_cast<const Codecs* (*)()>(OpenModule("liblumi_codecs.so", "LumigraphCodecs", "pictures"))();
  return *codecs;
}

const VideoCodecs& LoadVideoCodecs() {
  static const VideoCodecs* codecs =
      reinterpret_cast<const VideoCodecs* (*)()>(OpenModule("liblumi_video.so", "LumigraphVideoCodecs", "videos"))();
  return *codecs;
}

}  // namespace lumi
