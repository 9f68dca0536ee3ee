#include "export/web_package.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "export/own_output.h"
#include "scene/files/atomic_file.h"

namespace lumi {
namespace fs = std::filesystem;

// Name and text of each file of page/; made by CMakeLists.txt.
extern const std::vector<std::pair<std::string, std::string>> kPageFiles;

namespace {

// Marks a page as ours: page/page.html has this text among its first bytes.
constexpr const char* kPageGenerator = "<meta name=\"generator\" content=\"Lumigraph\">";

const std::string& PageFile(const std::string& name) {
  const auto found = std::ranges::find(kPageFiles, name, &std::pair<std::string, std::string>::first);
  if (found == kPageFiles.end()) throw std::logic_error("no such page file: " + name);
  return found->second;
}

std::string Replaced(std::string text, const std::string& what, const std::string& with) {
  text.replace(text.find(what), what.size(), with);
  return text;
}

// The page around its data.
std::string Page(const std::string& data) {
  nlohmann::json shaders = nlohmann::json::object();
  for (const auto& [name, text] : kPageFiles)
    if (name.ends_with(".vert") || name.ends_with(".frag") || name.ends_with(".glsl")) shaders[name] = text;
  std::string script = "const pageShaders = " + shaders.dump() + ";\n";
  for (const char* name :
       {"math.js", "data.js", "gl.js", "photos.js", "renderer.js", "camera.js", "controls.js", "ui.js", "main.js"})
    script += PageFile(name);
  std::string page = Replaced(PageFile("page.html"), "@STYLE@", PageFile("page.css"));
  page = Replaced(std::move(page), "@SCRIPT@", script);
  return Replaced(std::move(page), "@DATA@", data);
}

std::string Base64(const std::string& bytes) {
  static const char* const letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto at = [&](std::size_t k) {
      return k < bytes.size() ? static_cast<unsigned>(static_cast<unsigned char>(bytes[k])) : 0U;
    };
    const unsigned v = at(i) << 16 | at(i + 1) << 8 | at(i + 2);
    for (int k = 0; k < 4; ++k)
      text += i + static_cast<std::size_t>(k) <= bytes.size() ? letters[v >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

}  // namespace

double WriteOneFile(const WebPage& page, const fs::path& file) {
  std::string data = "<script type=\"application/json\" id=\"part-manifest\">" + page.manifest + "</script>\n";
  for (const WebPart& part : page.parts)
    data += "<script type=\"text/plain\" id=\"part-" + part.name + "\">" + Base64(part.bytes) + "</script>\n";
  const std::string text = Page(data);
  WriteTextAtomically(file, text);
  return static_cast<double>(text.size());
}

void RequireOurOutput(const fs::path& output, bool one_file) {
  if (!one_file) return RequireOurExport(output, kWebMarker);
  RequireOurFile(output, kPageGenerator, "page");
}

double WriteWebFolder(const WebPage& page, const fs::path& folder) {
  const FolderLock lock(folder);
  WriteTextAtomically(folder / kWebMarker, "made by lumi-export web\n");
  std::set<fs::path> written;
  double bytes = 0;
  const auto write = [&](const fs::path& name, const std::string& content) {
    WriteBytesAtomically(folder / name, content.data(), content.size());
    written.insert(name);
    bytes += static_cast<double>(content.size());
  };
  for (const WebPart& part : page.parts) write(part.name, part.bytes);
  write("manifest.json", page.manifest);
  // The page is written last: where it exists, the files that it requests exist, too.
  write("index.html", Page(""));
  // Removes photos of an earlier export that had more of them.
  std::error_code ec;
  for (const auto& entry : fs::directory_iterator(folder / "photos", ec))
    if (!written.contains(fs::path("photos") / entry.path().filename())) fs::remove(entry.path(), ec);
  return bytes;
}

}  // namespace lumi
