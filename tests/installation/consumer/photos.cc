// Says of a scene how many photos it has, by the libraries: opens files, and renders a picture.
#include <cstdio>

#include "render/lumigraph/lumigraph.h"

int main(int, char** argv) {
  lumi::LumigraphOptions options;
  options.scene = argv[1];
  lumi::Lumigraph lumigraph(options, lumi::SilentProgress());
  lumigraph.MakePictures("", false);
  lumigraph.ReadPhotos(lumi::SilentProgress());
  const auto& scene = lumigraph.scene();
  lumi::RenderRequest request;
  request.view = lumi::MakeRenderView(scene, scene.views.front());
  lumigraph.ChooseMeasures({request.view}, {});
  request.settings = lumigraph.At(request.view);
  const lumi::ImageF image = lumigraph.NewRenderer(lumi::MakeCpuRenderer)->Render(request);
  std::printf("%zu photos, the first %d pixels wide\n", scene.views.size(), image.width);
}
