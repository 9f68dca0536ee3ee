// A colour for a source view, distinct from its neighbours' (golden-ratio hues, alternating lightness), RGB [0,1].
#pragma once

#include <Eigen/Core>

namespace lumi {

Eigen::Vector3f SourceColor(int view_index);

}  // namespace lumi
