#include "tests/architecture/tree_rules.h"

#include <algorithm>
#include <functional>
#include <regex>
#include <set>
#include <sstream>

#include "scene/files/atomic_file.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

const std::set<std::string> kStages = {"simulate",     "calibrate", "reconstruct", "proxy",    "render",
                                       "timeperiodic", "stabilize", "export",      "pipeline", "python"};

struct SourceLine {
  std::string file;    // relative to the root
  std::string folder;  // its first part
  int number = 0;
  std::string text;
  std::string include;  // what is included, or empty
  bool IsHeader() const { return file.ends_with(".h"); }
  bool IsMain() const { return file.ends_with("main.cc"); }
  bool Below(const std::string& place) const { return file.starts_with(place); }
};

bool StartsWithAny(const std::string& text, const std::vector<std::string>& starts) {
  return std::any_of(starts.begin(), starts.end(), [&](const std::string& s) { return text.starts_with(s); });
}

// Shows nlohmann-json, to sources of scene/files alone.
constexpr const char* kJsonFields = "scene/files/json_fields.h";

struct Rule {
  std::string says;
  std::function<bool(const SourceLine&)> broken;
};

// A library whose headers start with `headers` is used below `allowed` only.
Rule Confined(const std::string& library, std::vector<std::string> headers, std::vector<std::string> allowed) {
  return {library + " is used in its own stage only", [=](const SourceLine& line) {
            return StartsWithAny(line.include, headers) && !StartsWithAny(line.file, allowed);
          }};
}

const std::vector<Rule>& Rules() {
  static const std::vector<Rule> rules = {
      {"scene uses no stage",
       [](const SourceLine& l) {
         return l.folder == "scene" && kStages.count(l.include.substr(0, l.include.find('/'))) > 0;
       }},
      // What is exported, and what Python sees, is what the renderer draws.
      {"a stage uses itself and scene only",
       [](const SourceLine& l) {
         const std::string target = l.include.substr(0, l.include.find('/'));
         return kStages.count(l.folder) > 0 && kStages.count(target) > 0 && target != l.folder &&
                !((l.folder == "export" || l.folder == "python") && target == "render");
       }},
      Confined("pybind11", {"pybind11/"}, {"python/"}),
      {"no source uses the tests", [](const SourceLine& l) { return l.include.starts_with("tests/"); }},
      {"the radiance core has no GL, no threads and no files",
       [](const SourceLine& l) {
         return l.Below("render/radiance/") &&
                (StartsWithAny(l.include, {"GL/", "GLFW/", "EGL/", "epoxy/", "imgui", "backends/imgui", "render/gl/",
                                           "render/viewer/", "tbb/", "oneapi/", "scene/files/",
                                           "scene/program/parallel.h", "opencv2/", "OpenImageIO/"}) ||
                 std::set<std::string>{"thread", "mutex", "future", "condition_variable", "execution", "fstream",
                                       "filesystem", "cstdio"}
                         .count(l.include) > 0);
       }},
      {"headers of scene show Eigen and the standard library only",
       [](const SourceLine& l) {
         return l.folder == "scene" && l.IsHeader() && l.file != kJsonFields && !l.Below("scene/files/openimageio/") &&
                StartsWithAny(l.include, {"opencv2/", "OpenImageIO/", "nlohmann/", "fmt/", "CLI/", "tbb/", "spdlog/",
                                          "sqlite3", "embree"});
       }},
      {"the reader of JSON fields is for scene/files",
       [](const SourceLine& l) { return l.include == kJsonFields && (!l.Below("scene/files/") || l.IsHeader()); }},
      {"the frame of the programs is for main.cc",
       [](const SourceLine& l) {
         return l.include == "scene/program/main_program.h" && !l.Below("scene/program/") && !l.IsMain();
       }},
      Confined("CLI11", {"CLI/"}, {"scene/program/"}),
      Confined("CGAL", {"CGAL/"}, {"proxy/", "render/"}),
      Confined("OpenMesh", {"OpenMesh/"}, {"proxy/"}),
      Confined("OpenGL", {"GL/", "GLFW/", "EGL/", "epoxy/", "imgui", "backends/imgui"}, {"render/"}),
      Confined("Embree", {"embree", "cmake/embree"}, {"render/", "simulate/"}),
      Confined("Ceres", {"ceres/"}, {"calibrate/", "reconstruct/", "timeperiodic/", "stabilize/"}),
      Confined("FFmpeg", {"libav", "libsw"}, {"scene/files/ffmpeg/"}),
      Confined("libheif", {"libheif/"}, {"scene/files/libheif/"}),
      Confined("SQLite", {"sqlite3"}, {"reconstruct/"}),
      {"a library neither prints nor exits",
       [](const SourceLine& l) {
         static const std::regex prints(
             R"(std::(cout|cerr|clog)\b|\bfmt::print\(|\b(std::)?f?printf\(|\bputs\(|(^|[^_\w])(std::)?(exit|abort|quick_exit)\()");
         return !l.IsMain() && !l.Below("scene/program/") && l.text.find("//") > l.text.find_first_not_of(' ') &&
                std::regex_search(l.text, prints);
       }},
      {"no path of one machine",
       [](const SourceLine& l) {
         return std::regex_search(l.text, std::regex(R"((^|["' =(])/(home|root|Users|mnt)/)")) ||
                l.text.find(LUMI_SOURCE_DIR "/") != std::string::npos;
       }},
  };
  return rules;
}

bool IsSource(const fs::path& path) {
  static const std::set<std::string> endings = {".h", ".cc", ".glsl", ".vert", ".frag", ".comp"};
  return endings.count(path.extension().string()) > 0;
}

}  // namespace

std::vector<std::string> BrokenRules(const fs::path& root) {
  static const std::regex include(R"re(^\s*#\s*include\s*[<"]([^>"]+)[>"])re");
  std::vector<std::string> broken;
  for (const fs::directory_entry& top : fs::directory_iterator(root)) {
    const std::string folder = top.path().filename().string();
    if (folder != "scene" && kStages.count(folder) == 0) continue;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(top.path())) {
      if (!entry.is_regular_file() || !IsSource(entry.path())) continue;
      SourceLine line;
      line.file = fs::relative(entry.path(), root).generic_string();
      line.folder = folder;
      std::istringstream text(ReadText(entry.path()));
      while (std::getline(text, line.text)) {
        ++line.number;
        std::smatch match;
        line.include = std::regex_search(line.text, match, include) ? match[1].str() : std::string();
        for (const Rule& rule : Rules())
          if (rule.broken(line))
            broken.push_back(line.file + ":" + std::to_string(line.number) + ": " + rule.says + ": " + line.text);
      }
    }
  }
  std::sort(broken.begin(), broken.end());
  return broken;
}

}  // namespace lumi
