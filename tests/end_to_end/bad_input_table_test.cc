// docs/bad-input.md says what the programs answer to what they cannot use. Each of its rows is made to happen here, and
// each case here has its row.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <sstream>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/mesh_io.h"
#include "scene/files/video.h"
#include "scene/geometry/projection.h"
#include "scene/program/subprocess.h"
#include "tests/support/bad_input.h"
#include "tests/support/simulated_capture.h"
#include "tests/support/small_scene.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

struct TableRow {
  std::string name;
  Words said;  // in this order
  int exit_code = 0;
};

std::string Trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(' '), last = text.find_last_not_of(' ');
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

// Rows "| case | what is said | exit code |"; "..." stands for what depends on the names of files.
std::vector<TableRow> ReadTable() {
  std::istringstream text(ReadText(fs::path(LUMI_SOURCE_DIR) / "docs" / "bad-input.md"));
  std::vector<TableRow> rows;
  for (std::string line; std::getline(text, line);) {
    if (!line.starts_with("| ")) continue;
    Words cells;
    std::istringstream parts(line.substr(1));
    for (std::string cell; std::getline(parts, cell, '|');) cells.push_back(Trimmed(cell));
    if (cells.size() < 3 || cells[2].find_first_not_of("0123456789") != std::string::npos || cells[2].empty()) continue;
    TableRow row{cells[0], {}, std::stoi(cells[2])};
    for (std::size_t at = 0; at <= cells[1].size();) {
      const std::size_t dots = std::min(cells[1].find("...", at), cells[1].size());
      if (const std::string piece = Trimmed(cells[1].substr(at, dots - at)); !piece.empty()) row.said.push_back(piece);
      at = dots + 3;
    }
    rows.push_back(row);
  }
  return rows;
}

// A transforms.json of one photo; `more` stands beside its matrix.
std::string Transforms(const std::string& top, const std::string& file_path,
                       const std::string& matrix = "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]") {
  return "{" + top + "\"frames\": [{\"file_path\": \"" + file_path + "\", \"transform_matrix\": " + matrix + "}]}";
}

std::string Replaced(const fs::path& file, const std::string& from, const std::string& to) {
  std::string text = ReadText(file);
  const auto at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("nothing to replace in " + file.string() + ": " + from);
  return text.replace(at, from.size(), to);
}

// A folder with what a case needs, and the command that meets it there.
class Cases {
 public:
  Cases() {
    AddInputs();
    AddCameraFiles();
    AddScenes();
    AddProxies();
    AddOutputs();
    AddWords();
  }
  const std::map<std::string, std::function<Refusal(const fs::path&)>>& all() const { return cases_; }

 private:
  static void Photo(const fs::path& file) { WriteImage(file, Image8(64, 48, 3, 90)); }
  static Scene Workspace(const fs::path& folder) {
    Scene scene = MakeSmallScene(folder / "images", 5);
    WriteColmapModel(scene, folder / "sparse");
    return scene;
  }
  static Scene OwnScene(const fs::path& folder, const std::string& proxy) {
    Scene scene = MakeSmallScene(folder / "images", 5);
    scene.active_proxy = proxy;
    WriteScene(scene, folder);
    Mesh wall;
    wall.vertices = {{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}};
    wall.faces = {{0, 1, 2}, {0, 2, 3}};
    if (!proxy.empty()) WriteMesh(ProxyPath(folder, proxy), wall);
    return scene;
  }
  void Add(const std::string& name, std::function<Refusal(const fs::path&)> make) {
    if (!cases_.emplace(name, std::move(make)).second) throw std::logic_error("twice: " + name);
  }
  // lumi-pipeline on what `make` leaves at the path that it is given.
  void AddInput(const std::string& name, const std::string& input, std::function<void(const fs::path&)> make) {
    Add(name, [input, make](const fs::path& f) {
      make(f / input);
      return Refusal{
          {"lumi-pipeline", (f / input).string(), "-o", (f / "out").string()}, 0, {}, f / "out", {f / input}};
    });
  }
  // lumi-render on a scene with a proxy called wall.
  void AddRender(const std::string& name, std::function<Words(const fs::path&)> options) {
    Add(name, [options](const fs::path& f) {
      OwnScene(f / "scene", "wall");
      Words argv = {"lumi-render", (f / "scene").string(), "-o", (f / "out").string()};
      const Words more = options(f);
      argv.insert(argv.end(), more.begin(), more.end());
      return Refusal{argv, 0, {}, f / "out", {f / "scene"}};
    });
  }

  static void Ffmpeg(Words arguments) {
    arguments.insert(arguments.begin(), {"ffmpeg", "-nostdin", "-v", "error", "-y"});
    if (const auto made = RunSubprocess(arguments); made.exit_code != 0)
      throw std::runtime_error("ffmpeg: " + testing::PrintToString(made.tail));
  }
  // All around, so that its left border goes on at the right one.
  static void Photo360(const fs::path& file, double turned) {
    Image8 around(512, 256, 3);
    for (int y = 0; y < around.height; ++y)
      for (int x = 0; x < around.width; ++x) {
        const double u = 2 * M_PI * (x + 0.5) / around.width + turned, v = M_PI * (y + 0.5) / around.height;
        const Eigen::Vector3d d(std::sin(v) * std::cos(u), std::sin(v) * std::sin(u), std::cos(v));
        const double detail = std::sin(23 * d.x() + 5 * d.z()) + std::sin(21 * d.y() - 3 * d.z()) +
                              std::sin(15 * d.x() - 16 * d.y() + 2 * d.z());
        for (int c = 0; c < 3; ++c) around.At(x, y, c) = static_cast<std::uint8_t>(128 + 35 * detail);
      }
    WriteImage(file, around);
  }
  // lumi-pipeline --stabilize on the film that `make` leaves at the path that it is given.
  void AddStabilize(const std::string& name, const std::string& input, const Words& more,
                    std::function<void(const fs::path&)> make) {
    Add(name, [=](const fs::path& f) {
      make(f / input);
      Words argv = {"lumi-pipeline", (f / input).string(), "--stabilize", "smooth", "-o", (f / "steady.mp4").string()};
      argv.insert(argv.end(), more.begin(), more.end());
      return Refusal{argv, 0, {}, f / "steady.mp4", {f / input}};
    });
  }
  // lumi-reconstruct on four photos where `colmap` is the script that is given; none: no such program.
  void AddColmap(const std::string& name, const std::optional<std::string>& script) {
    Add(name, [=](const fs::path& f) {
      MakeSmallScene(f / "photos", 4);
      fs::create_directories(f / "bin");
      if (script) {
        WriteTextAtomically(f / "bin/colmap", "#!/bin/sh\n" + *script + "\n");
        fs::permissions(f / "bin/colmap", fs::perms::owner_all);
      }
      return Refusal{{"lumi-reconstruct", (f / "photos").string(), "-o", (f / "out").string()},
                     0,
                     {},
                     {},
                     {f / "photos"},
                     {{"PATH", (f / "bin").string()}}};
    });
  }

  void AddInputs() {
    AddInput("no such folder", "photos", [](const fs::path&) {});
    AddInput("an empty folder", "photos", [](const fs::path& p) { fs::create_directories(p); });
    AddInput("a folder without photos", "photos",
             [](const fs::path& p) { WriteTextAtomically(p / "notes.txt", "no photo"); });
    AddInput("a folder with one film, and what a desktop left beside it", "films", [](const fs::path& p) {
      WriteTextAtomically(p / "walk.mp4", "a film");
      WriteTextAtomically(p / "._walk.mp4", "a desktop's");
    });
    AddInput("files that are called photos and are none", "photos", [](const fs::path& p) {
      WriteTextAtomically(p / "a.jpg", "no photo");
      WriteTextAtomically(p / "b.jpg", "no photo");
    });
    AddInput("one photo", "photos", [](const fs::path& p) { Photo(p / "a.png"); });
    AddInput("a film that is none", "walk.mp4", [](const fs::path& p) { WriteTextAtomically(p, "no film"); });
    AddInput("photos of 360 degrees", "photos", [](const fs::path& p) {
      for (int i = 0; i < 3; ++i) Photo360(p / fmt::format("around{}.jpg", i), i);
    });
    AddInput("a film of sound alone", "walk.mp4", [](const fs::path& p) {
      Ffmpeg({"-f", "lavfi", "-i", "sine=duration=0.2", p.string()});
    });
    AddStabilize("a film whose times fall, with `--stabilize`", "walk.ts", {}, [](const fs::path& p) {
      const fs::path part = p.parent_path() / "part.ts";
      Ffmpeg({"-f", "lavfi", "-i", "testsrc=s=160x120:r=25:d=0.2", "-c:v", "mpeg2video", part.string()});
      std::string parts;
      for (int i = 0; i < 20; ++i) parts += ReadText(part);
      WriteTextAtomically(p, parts);
    });
    AddStabilize("a film of one frame, with `--stabilize`", "walk.mp4", {}, [](const fs::path& p) {
      Ffmpeg({"-f", "lavfi", "-i", "testsrc=s=160x120:r=25:d=0.04", "-c:v", "mpeg4", p.string()});
    });
    AddStabilize("a film of another beside `-o steady.mp4` (`--stabilize --split-screen`)", "walk.mp4",
                 {"--split-screen"}, [](const fs::path& p) {
                   Ffmpeg({"-f", "lavfi", "-i", "testsrc=s=160x120:r=25:d=0.4", "-c:v", "mpeg4", p.string()});
                   WriteTextAtomically(p.parent_path() / "steady-split.mp4", "another film");
                 });
    Add("masks of other photos (`lumi-reconstruct --masks`)", [](const fs::path& f) {
      MakeSmallScene(f / "photos", 4);
      Photo(f / "masks/other.png");
      return Refusal{
          {"lumi-reconstruct", (f / "photos").string(), "-o", (f / "out").string(), "--masks", (f / "masks").string()},
          0,
          {},
          {},
          {f / "photos", f / "masks"}};
    });
    AddInput("a file of another kind", "letter.pdf", [](const fs::path& p) { WriteTextAtomically(p, "no film"); });
    Add("a scene or capture where photos are meant (`lumi-reconstruct`)", [](const fs::path& f) {
      OwnScene(f / "scene", "");
      return Refusal{
          {"lumi-reconstruct", (f / "scene").string(), "-o", (f / "out").string()}, 0, {}, f / "out", {f / "scene"}};
    });
    Add("a folder whose photos are in a folder inside (`lumi-calibrate`)", [](const fs::path& f) {
      Photo(f / "boards/images/a.png");
      return Refusal{{"lumi-calibrate", (f / "boards").string(), "-o", (f / "camera.yaml").string()},
                     0,
                     {},
                     f / "camera.yaml",
                     {f / "boards"}};
    });
  }

  void AddCameraFiles() {
    const auto json = [this](const std::string& name, const std::string& text) {
      AddInput("a `transforms.json` " + name, "capture/transforms.json", [text](const fs::path& file) {
        Photo(file.parent_path() / "images/a.png");
        WriteTextAtomically(file, text);
      });
    };
    json("that is no JSON", "{\"frames\": [");
    json("without `frames`", "{\"fl_x\": 60}");
    json("whose photos are not there", Transforms("\"fl_x\": 60, ", "images/z.png"));
    json("without a focal length", Transforms("", "images/a.png"));
    json("whose matrix is none", Transforms("\"fl_x\": 60, ", "images/a.png", "[1, 2, 3]"));
    json("that names a photo elsewhere", Transforms("\"fl_x\": 60, ", "../../photos/a.png"));
    json("that names a photo by an absolute path", Transforms("\"fl_x\": 60, ", "/etc/hostname"));
    AddInput("a COLMAP workspace without points", "capture", [](const fs::path& p) {
      Scene scene = MakeSmallScene(p / "images", 5);
      scene.points.clear();
      WriteColmapModel(scene, p / "sparse");
    });
    AddInput("a COLMAP workspace without one of its photos", "capture", [](const fs::path& p) {
      Workspace(p);
      fs::remove(p / "images/photo12.png");
    });
    AddInput("a COLMAP model that is cut off", "capture", [](const fs::path& p) {
      Workspace(p);
      fs::resize_file(p / "sparse/images.bin", 40);
    });
    AddInput("a COLMAP model that names a photo elsewhere", "capture", [](const fs::path& p) {
      Scene scene = MakeSmallScene(p / "images", 5);
      scene.views[0].name = "../photo10.png";
      WriteColmapModel(scene, p / "sparse");
    });
  }

  void AddScenes() {
    const auto scene = [this](const std::string& name, std::function<void(const fs::path&)> spoil) {
      Add("a scene " + name, [spoil](const fs::path& f) {
        OwnScene(f / "scene", "wall");
        spoil(f / "scene");
        return Refusal{
            {"lumi-render", (f / "scene").string(), "-o", (f / "out").string()}, 0, {}, f / "out", {f / "scene"}};
      });
    };
    scene("without one of its photos", [](const fs::path& s) { fs::remove(s / "images/photo12.png"); });
    Add("a scene without one of its photos (`lumi-proxy auto`)", [](const fs::path& f) {
      OwnScene(f / "scene", "");
      fs::remove(f / "scene/images/photo12.png");
      return Refusal{
          {"lumi-proxy", "auto", (f / "scene").string(), "--candidates", "plane,delaunay", "--proxy-minutes", "0"},
          0,
          {},
          {},
          {f / "scene/images"}};
    });
    scene("whose `lumigraph.json` is of a newer version", [](const fs::path& s) {
      WriteTextAtomically(s / "lumigraph.json", Replaced(s / "lumigraph.json", "\"version\": 1", "\"version\": 2"));
    });
    scene("whose `lumigraph.json` is cut off",
          [](const fs::path& s) { fs::resize_file(s / "lumigraph.json", fs::file_size(s / "lumigraph.json") / 2); });
    scene("whose `lumigraph.json` leads to photos elsewhere", [](const fs::path& s) {
      WriteTextAtomically(s / "lumigraph.json",
                          Replaced(s / "lumigraph.json", "\"images\": \"images\"", "\"images\": \"../photos\""));
    });
    for (const auto& [name, photo] : std::map<std::string, std::string>{
             {"whose `projective.json` leads to photos elsewhere", "../photo10.png"},
             {"whose `projective.json` names a photo by an absolute path", "/etc/hostname"}})
      scene(name, [photo = photo](const fs::path& s) {
        Scene matrices = MakeSmallScene(s / "images", 5);
        for (View& v : matrices.views) {
          v.P = ProjectionMatrix((Eigen::Matrix3d() << 60, 0, 32, 0, 60, 24, 0, 0, 1).finished(), v.cam_from_world);
          v.size_px = {64, 48};
        }
        for (Point& p : matrices.points) p.X_in_world = p.x_in_world.homogeneous();
        matrices.frame = Frame::kProjective;
        WriteScene(matrices, s);
        WriteTextAtomically(s / "projective.json", Replaced(s / "projective.json", "photo10.png", photo));
      });
  }

  void AddProxies() {
    Add("another tool's workspace, which has no proxy (`lumi-render`)", [](const fs::path& f) {
      Workspace(f / "capture");
      return Refusal{
          {"lumi-render", (f / "capture").string(), "-o", (f / "out").string()}, 0, {}, f / "out", {f / "capture"}};
    });
    Add("a proxy for another tool's workspace (`lumi-proxy`)", [](const fs::path& f) {
      Workspace(f / "capture");
      return Refusal{{"lumi-proxy", "plane", (f / "capture").string()}, 0, {}, {}, {f / "capture"}};
    });
    AddRender("a proxy that the scene does not have", [](const fs::path&) { return Words{"--proxy", "hull"}; });
    AddRender("a proxy's file that is not there", [](const fs::path& f) {
      return Words{"--proxy", (f / "mesh.ply").string()};
    });
    for (const auto& [name, line] :
         std::map<std::string, std::string>{{"a proxy's file with a face of a corner that it lacks", "f 1 2 9"},
                                            {"a proxy's file with a corner that is no number", "v 0 nan 1\nf 1 2 4"},
                                            {"a proxy's file without a face", ""}})
      AddRender(name, [line = line](const fs::path& f) {
        WriteTextAtomically(f / "mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n" + line + "\n");
        return Words{"--proxy", (f / "mesh.obj").string()};
      });
    AddRender("a proxy's file that is no mesh", [](const fs::path& f) {
      WriteTextAtomically(f / "mesh.ply", "no mesh");
      return Words{"--proxy", (f / "mesh.ply").string()};
    });
  }

  void AddOutputs() {
    Add("pictures into a scene", [](const fs::path& f) {
      OwnScene(f / "scene", "wall");
      return Refusal{{"lumi-render", (f / "scene").string(), "-o", (f / "scene").string()}, 0, {}, {}, {f / "scene"}};
    });
    for (const char* name : {"film.avi", "picture.png"})
      Add(std::string("`lumi-render -o ") + name + "`", [name](const fs::path& f) {
        OwnScene(f / "scene", "wall");
        return Refusal{
            {"lumi-render", (f / "scene").string(), "-o", (f / name).string()}, 0, {}, f / name, {f / "scene"}};
      });
    Add("a film onto somebody else's (`lumi-render`)", [](const fs::path& f) {
      OwnScene(f / "scene", "wall");
      WriteTextAtomically(f / "holiday.mp4", "years of work");
      return Refusal{{"lumi-render", (f / "scene").string(), "-o", (f / "holiday.mp4").string()},
                     0,
                     {},
                     {},
                     {f / "scene", f / "holiday.mp4"}};
    });
    Add("a film onto somebody else's (`lumi-pipeline --stabilize`)", [](const fs::path& f) {
      VideoWriter shaky(f / "shaky.mp4", 25);
      for (int i = 0; i < 30; ++i) shaky.Add(Image8(64, 48, 3, static_cast<std::uint8_t>(100 + i)));
      shaky.Finish();
      WriteTextAtomically(f / "holiday.mp4", "years of work");
      return Refusal{
          {"lumi-pipeline", (f / "shaky.mp4").string(), "--stabilize", "smooth", "-o", (f / "holiday.mp4").string()},
          0,
          {},
          {},
          {f / "holiday.mp4"}};
    });
    // lumi-export onto what is there, which stays.
    const auto export_onto = [this](const std::string& name, const Words& words, const char* file) {
      Add(name, [words, file](const fs::path& f) {
        OwnScene(f / "scene", "wall");
        WriteTextAtomically(f / file, "years of work");
        Words argv = {"lumi-export", words[0], (f / "scene").string()};
        for (std::size_t i = 1; i < words.size(); ++i)
          argv.push_back(words[i].starts_with("-") ? words[i] : (f / words[i]).string());
        return Refusal{argv, 0, {}, {}, {f / "scene", f / file}};
      });
    };
    export_onto("a web page onto somebody else's", {"web", "-o", "home.html"}, "home.html");
    export_onto("a web page's folder onto somebody else's", {"web", "-o", "home"}, "home/thesis.txt");
    export_onto("glTF onto somebody else's", {"gltf", "-o", "model.glb"}, "model.glb");
    export_onto("points beside glTF onto somebody else's", {"gltf", "-o", "model.glb", "--points", "points.ply"},
                "points.ply");
    for (const char* option : {"-o", "--as-scene"})
      Add(std::string("`lumi-export web SCENE ") + option + " SCENE`", [option](const fs::path& f) {
        OwnScene(f / "scene", "wall");
        Words argv = {"lumi-export", "web", (f / "scene").string(), option, (f / "scene").string()};
        if (option != std::string("-o")) argv.insert(argv.end(), {"-o", (f / "page").string()});
        return Refusal{argv, 0, {}, f / "page", {f / "scene"}};
      });
    Add("a web page that its megabytes cannot hold", [](const fs::path& f) {
      OwnScene(f / "scene", "wall");
      return Refusal{
          {"lumi-export", "web", (f / "scene").string(), "-o", (f / "page.html").string(), "--max-mb", "0.2"},
          0,
          {},
          f / "page.html",
          {f / "scene"}};
    });
    Add("a web page of a scene without a proxy", [](const fs::path& f) {
      OwnScene(f / "scene", "");
      return Refusal{{"lumi-export", "web", (f / "scene").string(), "-o", (f / "page.html").string()},
                     0,
                     {},
                     f / "page.html",
                     {f / "scene"}};
    });
    Add("`lumi-pipeline -o film.mp4`", [](const fs::path& f) {
      Workspace(f / "capture");
      return Refusal{{"lumi-pipeline", (f / "capture").string(), "-o", (f / "film.mp4").string()},
                     0,
                     {},
                     f / "film.mp4",
                     {f / "capture"}};
    });
    Add("an output below a file", [](const fs::path& f) {
      Workspace(f / "capture");
      WriteTextAtomically(f / "letter", "dear");
      return Refusal{{"lumi-pipeline", (f / "capture").string(), "-o", (f / "letter/out").string()},
                     0,
                     {},
                     {},
                     {f / "capture", f / "letter"}};
    });
    Add("a scene that another program is writing (`lumi-proxy`)", [](const fs::path& f) {
      OwnScene(f / "scene", "");
      return Refusal{{"lumi-proxy", "plane", (f / "scene").string()}, 0, {}, {}, {}, {},
                     std::make_shared<FolderLock>(f / "scene")};
    });
    Add("somebody else's folder", [](const fs::path& f) {
      Workspace(f / "capture");
      WriteTextAtomically(f / "out/thesis.txt", "years of work");
      return Refusal{
          {"lumi-pipeline", (f / "capture").string(), "-o", (f / "out").string()}, 0, {}, f / "out", {f / "capture"}};
    });
    Add("what another program's failed run has left", [](const fs::path& f) {
      fs::create_directories(f / "out/provenance");
      WriteTextAtomically(f / "out/colmap/colmap.log", "no luck");
      return Refusal{
          {"lumi-simulate", "--example", "desk", "--views", "2", "--width", "32", "-o", (f / "out").string()},
          0,
          {},
          f / "out",
          {}};
    });
    Add("a capture made with other options", [](const fs::path& f) {
      const Words line = {"lumi-simulate", "--example", "desk", "--width", "32", "-o", (f / "out").string(), "--views"};
      Words first = line, second = line;
      first.push_back("2");
      second.push_back("3");
      if (const ProgramResult made = RunProgram(first); made.exit_code != 0) throw std::runtime_error(made.err);
      return Refusal{second, 0, {}, f / "out", {}};
    });
    Add("an export onto something", [](const fs::path& f) {
      OwnScene(f / "scene", "");
      WriteTextAtomically(f / "transforms.json", "{}");
      return Refusal{{"lumi-reconstruct", "export", (f / "scene").string(), "-o", (f / "transforms.json").string()},
                     0,
                     {},
                     {},
                     {f / "scene", f / "transforms.json"}};
    });
  }

  void AddWords() {
    const auto line = [this](const std::string& name, Words argv) {
      Add(name, [argv](const fs::path&) { return Refusal{argv, 0, {}, {}, {}}; });
    };
    AddColmap("COLMAP is not installed (`lumi-reconstruct`)", std::nullopt);
    AddColmap(
        "COLMAP is killed (`lumi-reconstruct`)",
        "case \"$*\" in help|*-h) exec '" + FindProgram("colmap").value().string() + "' \"$@\";; *) kill -9 $$;; esac");
    AddColmap("COLMAP does nothing (`lumi-reconstruct`)", "exit 0");
    line("`lumi-pipeline a.mp4 b.mp4 --stabilize smooth`",
         {"lumi-pipeline", "a.mp4", "b.mp4", "--stabilize", "smooth", "-o", "steady.mp4"});
    line("`lumi-pipeline a.mp4 --stabilize smooth --fps 0`",
         {"lumi-pipeline", "a.mp4", "--stabilize", "smooth", "-o", "steady.mp4", "--fps", "0"});
    line("`lumi-render SCENE --widht 320`", {"lumi-render", "SCENE", "-o", "OUT", "--widht", "320"});
    line("`lumi-render SCENE --width`", {"lumi-render", "SCENE", "-o", "OUT", "--width"});
    line("`lumi-render SCENE --width wide`", {"lumi-render", "SCENE", "-o", "OUT", "--width", "wide"});
    line("`lumi-render SCENE OUT`", {"lumi-render", "SCENE", "OUT"});
    line("`lumi-render properties SCENE OUT`", {"lumi-render", "properties", "SCENE", "OUT"});
    line("`lumi-render methods SCENE --view 3`", {"lumi-render", "methods", "SCENE", "--view", "3"});
    line("`lumi-render SCENE --show tesselation`", {"lumi-render", "SCENE", "-o", "OUT", "--show", "tesselation"});
    line("`lumi-reconstruct PHOTOS --outptu SCENE`", {"lumi-reconstruct", "PHOTOS", "--outptu", "SCENE"});
    line("`lumi-reconstruct PHOTOS --backend colmpa`",
         {"lumi-reconstruct", "PHOTOS", "-o", "SCENE", "--backend", "colmpa"});
    line("`lumi-proxy plaen SCENE`", {"lumi-proxy", "plaen", "SCENE"});
    line("`lumi-proxy`", {"lumi-proxy"});
    line("`lumi-proxy plane SCENE --sides 4`", {"lumi-proxy", "plane", "SCENE", "--sides", "4"});
    line("`lumi-pipeline PHOTOS --proxy sphere`", {"lumi-pipeline", "PHOTOS", "-o", "SCENE", "--proxy", "sphere"});
    AddRender("a photo that the scene does not have", [](const fs::path&) { return Words{"--view", "attic"}; });
    AddRender("a camera path without a key's time", [](const fs::path& f) {
      WriteTextAtomically(f / "path.json",
                          "{\"format\": \"lumigraph-path\", \"version\": 1, \"keys\": [{\"position\": [0, 0, 0], "
                          "\"cam_from_world_xyzw\": [0, 0, 0, 1], \"vertical_fov_deg\": 60}]}");
      return Words{"--path", (f / "path.json").string()};
    });
    AddRender("a camera path whose field of view is a text", [](const fs::path& f) {
      WriteTextAtomically(f / "path.json",
                          "{\"format\": \"lumigraph-path\", \"version\": 1, \"keys\": [{\"position\": [0, 0, 0], "
                          "\"cam_from_world_xyzw\": [0, 0, 0, 1], \"vertical_fov_deg\": \"wide\", \"time_s\": 0}]}");
      return Words{"--path", (f / "path.json").string()};
    });
  }

  std::map<std::string, std::function<Refusal(const fs::path&)>> cases_;
};

TEST(BadInputTable, EachRowIsWhatIsSaid) {
  const Cases cases;
  std::set<std::string> in_table;
  for (const TableRow& row : ReadTable()) {
    SCOPED_TRACE(row.name);
    EXPECT_TRUE(in_table.insert(row.name).second) << "comes twice";
    const auto it = cases.all().find(row.name);
    if (it == cases.all().end()) {
      ADD_FAILURE() << "nothing makes this row of docs/bad-input.md happen";
      continue;
    }
    const TemporaryFolder folder;
    Refusal refusal = it->second(folder.path());
    refusal.exit_code = row.exit_code;
    refusal.line_names = row.said;
    ExpectRefusal(refusal);
  }
  for (const auto& [name, make] : cases.all())
    EXPECT_TRUE(in_table.contains(name)) << "docs/bad-input.md has no row \"" << name << "\"";
}

}  // namespace
}  // namespace lumi
