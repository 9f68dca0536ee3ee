// Why a photo got no camera, read from the database: said in a way that helps to shoot again.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "reconstruct/colmap_database.h"
#include "reconstruct/options.h"
#include "reconstruct/photos.h"

namespace lumi {

// registered: the names that have a camera; other_components: names in each of the parts that were not chosen.
std::vector<MissingPhoto> ExplainMissing(const Capture& capture, const ColmapDatabase& database,
                                         const std::set<std::string>& registered,
                                         const std::vector<std::set<std::string>>& other_components);

}  // namespace lumi
