// Figures of lumi-export's web pages in Chromium (WebGL on the CPU where there is no GPU): the table of docs/web.md.
//
//   web_bench --work DIR [--capture SCENE ...] [--streamed N]
//
// Pages of a simulated desk of 24, 50, 100 and 262 photos 640 px wide, kept below DIR, and of the scenes given; then a
// folder of N photos that is streamed.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/program/error.h"
#include "scene/program/main_program.h"
#include "simulate/examples.h"
#include "tests/support/child_program.h"
#include "tests/support/static_server.h"
#include "tests/support/web_page.h"

namespace {

namespace fs = std::filesystem;
using namespace lumi;
using nlohmann::json;

constexpr double kMostSeconds = 3600;
constexpr int kFrames = 9, kRounds = 3;
constexpr int kWidth = 640, kHeight = 480;
constexpr int kWindowWidth = 1280, kWindowHeight = 800;

json Run(const std::vector<std::string>& argv) {
  const ProgramResult run = ChildProgram(argv).Wait(kMostSeconds);
  if (run.exit_code != 0) throw Error(ExitCode::kBug, argv.front() + ": " + run.err);
  return json::parse(run.out, nullptr, false);
}

fs::path Desk(const fs::path& work, int photos) {
  const fs::path desk = work / fmt::format("web-desk-{}", photos);
  if (fs::exists(desk / "lumigraph.json")) return desk;
  // More photos than the example's path has: taken closer to each other.
  json scene = json::parse(ExampleJson("desk"));
  json& views = scene["path"]["views"];
  views = std::max(photos, views.get<int>());
  const fs::path description = work / fmt::format("web-desk-{}.json", photos);
  WriteTextAtomically(description, scene.dump());
  Run({"lumi-simulate", description.string(), "--views", std::to_string(photos), "--width", std::to_string(kWidth),
       "-o", desk.string(), "--quiet"});
  return desk;
}

double FrameMs(Chromium& browser) {
  // Five views of the fly-through, the median of each; all photos that they want are there.
  std::vector<double> ms;
  for (int i = 0; i < 5; ++i)
    ms.push_back(browser.Evaluate(fmt::format(
        "(async () => {{ const view = lumigraph.viewAlong({}, {}, {}); await lumigraph.picture(view); return "
        "lumigraph.time(view, {}); }})()",
        (i + 0.5) / 5, kWidth, kHeight, kFrames)));
  std::ranges::sort(ms);
  return ms[ms.size() / 2];
}

// Each page in a browser of its own: memory and the first picture are of nothing else.
fs::path Page(const fs::path& scene, const fs::path& work, int max_mb = 32) {
  Chromium browser(kWindowWidth, kWindowHeight);
  const std::string name = fmt::format("{}, {} MB", scene.filename().string(), max_mb);
  const std::string file = fmt::format("{}-{}", scene.filename().string(), max_mb);
  const fs::path page = work / "web" / (file + ".html"), data = work / "web" / (file + "-data");
  fs::create_directories(page.parent_path());
  const json made = Run({"lumi-export", "web", scene.string(), "-o", page.string(), "--as-scene", data.string(),
                         "--max-mb", std::to_string(max_mb), "--json", "--quiet"});
  OpenPage(browser, "file://" + page.string());
  const double first_s = browser.Evaluate("lumigraph.firstPicture.ms").get<double>() / 1000;
  const double graphics_mb = browser.Evaluate("lumigraph.graphicsBytes").get<double>() / 1e6;
  const double memory_mb = browser.MemoryMb();
  const PageAgreement agreement = AgreementOf(browser, data, scene, 6, 5);
  fmt::print("| {} | {} of {} | {:.1f} | {} | {:.1f} | {:.2f} | {:.1f} | {:.2f} | {:.0f} | {:.0f} |\n", name,
             made["photos"].get<int>(), made["photos_of_scene"].get<int>(), made["mb"].get<double>(),
             made["faces"].get<int>(), agreement.worst.psnr_db, 100 * agreement.worst.differ, agreement.of_scene_db,
             first_s, graphics_mb, memory_mb);
  std::fflush(stdout);
  return page;
}

void Streamed(const fs::path& work, int photos, double memory_mb) {
  Chromium browser(kWindowWidth, kWindowHeight);
  const fs::path desk = Desk(work, photos), folder = work / "web" / fmt::format("desk-{}", photos);
  const json made = Run({"lumi-export", "web", desk.string(), "-o", folder.string(), "--max-mb", "400", "--memory-mb",
                         fmt::format("{}", memory_mb), "--json", "--quiet"});
  const StaticServer server(folder);
  browser.Open("about:blank");
  const double empty_mb = browser.MemoryMb();
  OpenPage(browser, server.Url("index.html"));
  const double first_mb = (browser.Evaluate("lumigraph.firstPicture.bytes").get<double>() +
                           static_cast<double>(fs::file_size(folder / "index.html"))) /
                          1e6,
               first_s = browser.Evaluate("lumigraph.firstPicture.ms").get<double>() / 1000;
  double most_graphics_mb = 0, most_mb = 0;
  for (int i = 0; i < 20; ++i) {
    browser.Evaluate(fmt::format("lumigraph.picture(lumigraph.viewAlong({}, {}, {})).then(() => 0)", (i + 0.5) / 20,
                                 kWidth, kHeight));
    most_graphics_mb = std::max(most_graphics_mb, browser.Evaluate("lumigraph.graphicsBytes").get<double>() / 1e6);
    most_mb = std::max(most_mb, browser.MemoryMb());
  }
  fmt::print("| {} | {:.1f} | {:.2f} | {:.2f} | {:.0f} | {:.0f} | {:.0f} | {:.0f} | {:.0f} |\n",
             made["photos"].get<int>(), made["mb"].get<double>(), first_mb, first_s, memory_mb, most_graphics_mb,
             empty_mb, most_mb, static_cast<double>(server.bytes_sent()) / 1e6);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  Program program("web_bench", "Figures of web pages, in Chromium");
  fs::path work;
  std::vector<std::string> captures;
  int streamed = 0;
  Options options = program.options();
  options.Add("--work", work, "Where captures and pages are kept").Required();
  options.Add("--capture", captures, "More scenes");
  options.Add("--streamed", streamed, "Also a streamed folder of so many photos; 0: none").Default().Range(0, 100000);
  program.RunAndExit(argc, argv, [&] {
    work = fs::absolute(work);  // as the browser needs it
    if (!Chromium::IsThere()) throw MachineError("no Chromium is installed", "Debian's package chromium");
    fmt::print("{}\n\n", Chromium(kWindowWidth, kWindowHeight).Version());
    fmt::print(
        "| scene | photos | MB | faces | least dB to the same data | pixels that differ in coverage, % | mean dB to "
        "the "
        "whole scene | first picture s | graphics MB | browser MB |\n|---|---|---|---|---|---|---|---|---|---|\n");
    Page(Desk(work, 24), work);
    const fs::path fifty = Page(Desk(work, 50), work);
    Page(Desk(work, 100), work);
    Page(Desk(work, 262), work);
    const fs::path many = Page(Desk(work, 262), work, 80);  // all of its photos
    for (const std::string& scene : captures) Page(scene, work);
    // In turns, as other programs may be at work.
    Chromium browser(kWindowWidth, kWindowHeight);
    double few_ms = 1e9, many_ms = 1e9;
    for (int round = 0; round < kRounds; ++round) {
      OpenPage(browser, "file://" + fifty.string());
      few_ms = std::min(few_ms, FrameMs(browser));
      OpenPage(browser, "file://" + many.string());
      many_ms = std::min(many_ms, FrameMs(browser));
    }
    fmt::print("\n{} x {}: {:.0f} ms a frame of 50 photos, {:.0f} of 262: {:.2f} times\n", kWidth, kHeight, few_ms,
               many_ms, many_ms / few_ms);
    if (streamed == 0) return Answer(JsonKeys(), "");
    fmt::print(
        "\n| streamed photos | MB | MB to the first picture | first picture s | --memory-mb | graphics MB, at most | "
        "browser "
        "MB, empty | at most | MB sent in all |\n|---|---|---|---|---|---|---|---|---|\n");
    for (const int photos : {100, streamed}) Streamed(work, photos, 256);
    return Answer(JsonKeys(), "");
  });
}
