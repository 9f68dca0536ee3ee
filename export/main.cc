// lumi-export: a scene for others to look at.
#include "export/gltf_export.h"
#include "export/web_export.h"
#include "scene/program/main_program.h"

int main(int argc, char** argv) {
  using namespace lumi;
  Program program("lumi-export", "A scene as a web page to walk in, or as glTF");
  WebOptions web;
  Options command =
      program.Command("web", "A page that any browser with WebGL 2 shows: one file, or a folder for a web server",
                      [&] { return ExportWeb(web, program.progress()); });
  command.Add("scene", web.scene, "Scene folder, COLMAP workspace or transforms.json").Required();
  command.Add("-o,--output", web.output,
              "FILE.html: one page that opens from disk; else a folder, whose photos are streamed");
  command.Add("--proxy", web.proxy, "Proxy by name, or a mesh file (PLY, OBJ); default: the scene's active one");
  command.Add("--effects", web.effects, "As lumi-render --effects").Default();
  command.Add("--max-mb", web.max_mb, "Most megabytes of what is written, > 0").Default();
  command.Add("--width", web.width_px, "Photos at most so wide, pixels; default: as is best for the megabytes")
      .Range(1, 20000);
  command
      .Add("--memory-mb", web.memory_mb,
           "Megabytes of the graphics processor's memory for photos, what they see, and the proxy (16 photos stay in "
           "any "
           "case); 0: by the device, at most 1024")
      .Default()
      .Range(0, 65536);
  command.Add("--as-scene", web.as_scene,
              "Also write what the page holds (reduced photos, rounded proxy) as a scene, for lumi-render");
  command.Flag("--tradeoff", web.tradeoff, "Instead of a page: megabytes against the error of held-out photos");
  GltfOptions gltf;
  Options glb = program.Command("gltf", "The proxy with a colour a vertex, and the photos' cameras, as glTF 2.0",
                                [&] { return ExportGltf(gltf, program.progress()); });
  glb.Add("scene", gltf.scene, "Scene folder, COLMAP workspace or transforms.json").Required();
  glb.Add("-o,--output", gltf.output, "FILE.glb").Required();
  glb.Add("--proxy", gltf.proxy, "Proxy by name, or a mesh file (PLY, OBJ); default: the scene's active one");
  glb.Add(
      "--points", gltf.points,
      "Also FILE.ply: the proxy's vertices and the scene's points with normals and colours, as splat tools begin with");
  program.options().RequireCommand();
  program.options().Examples(
      "lumi-export web scene -o walk.html          one file that can be mailed\n"
      "lumi-export gltf scene -o scene.glb         the proxy with colours, and the cameras");
  program.RunAndExit(argc, argv);
}
