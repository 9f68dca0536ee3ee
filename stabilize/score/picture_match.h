// Where a stabilised frame shows its original: the homography between two pictures of one moment, of any scale between.
#pragma once

#include <memory>
#include <optional>

#include "scene/model/image.h"
#include "stabilize/score/homography.h"

namespace lumi::score {

// Features of one picture, once for all that are matched with it.
class PictureFeatures {
 public:
  explicit PictureFeatures(const Image8& grey);  // keeps a reference: the picture must outlive it
  ~PictureFeatures();
  PictureFeatures(PictureFeatures&&) noexcept;
  PictureFeatures& operator=(PictureFeatures&&) noexcept;

  struct Impl;
  const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

// output_from_input: ORB features that agree by RANSAC, then the residual movement of corners against the input warped
// so. None where the pictures have too little in common.
std::optional<FittedHomography> MatchPictures(const PictureFeatures& input, const PictureFeatures& output);

}  // namespace lumi::score
