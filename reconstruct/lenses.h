// Whether the photos that share a camera were taken by one lens. Where EXIF is silent, photos of one size are taken for
// one camera's: two phones, or one that zoomed, then bend the whole scene, with an error of a pixel and every photo
// placed. The points tell: a photo that another lens took wants another focal length than the rest.
#pragma once

#include <vector>

#include "reconstruct/standing.h"
#include "scene/model/scene.h"

namespace lumi {

struct FocalOfView {
  double ratio = 1;  // the focal length that its own points ask for, over its camera's
  double sigma = 0;  // standard deviation of the ratio's logarithm, the points held; infinity: not determined
};

// Each view's pose and focal length fitted anew to its points, which are held. Of a zoomed photo, a mapper keeps only
// the points that a step forward explains as well; so where a camera disagrees with much of its evidence, other focal
// lengths are tried on all of the evidence. scene: metric, distorted cameras, observations at keypoints; evidence: of
// each view, or empty.
std::vector<FocalOfView> FocalsOfViews(const Scene& scene, const std::vector<CameraEvidence>& evidence = {});

// A ratio further from 1 than this, and than so many standard deviations, is another lens (or another zoom).
constexpr double kOtherLens = 0.05;
constexpr double kOtherLensSigmas = 6;
bool OneLensExplains(const std::vector<FocalOfView>& focals);

// The scene with a camera for each group of photos of one size whose own focal lengths agree within 4 %: its parameters
// are the group's medians. Groups of five and more get two radial terms.
Scene ShareLikeLenses(const Scene& scene);

}  // namespace lumi
