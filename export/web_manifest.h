// What a page is made of: a manifest (JSON) and binary parts, which a package puts into one file or a folder.
#pragma once

#include <string>
#include <vector>

#include "export/quantised_mesh.h"
#include "export/reduce_photos.h"
#include "render/lumigraph/lumigraph.h"
#include "render/path/camera_path.h"

namespace lumi {

struct WebPart {
  std::string name;  // a relative path; page/data.js asks for it
  std::string bytes;
};

struct WebPage {
  std::string manifest;  // JSON, safe inside a <script>
  std::vector<WebPart> parts;
};

struct WebPageOptions {
  bool previews = false;  // each photo in a quarter of its sides, too, for pages that stream
  double memory_mb = 0;   // of the graphics processor; 0: the page decides
};

// `mesh`: in the normalised frame.
WebPage MakeWebPage(const Lumigraph& lumigraph, const ReducedPhotos& reduced, const QuantisedMesh& mesh,
                    const CameraPath& path, const WebPageOptions& options);

}  // namespace lumi
