// Photos of one place: copies of a photo, a smaller or edited version of it, a second shot from the same hand. What is
// held out must be held out with them: rendered from its own copy, a photo says nothing about cameras, proxy or
// blending.
#pragma once

#include <vector>

#include "scene/model/scene.h"

namespace lumi {

class PhotoTwins {
 public:
  // Twins stand nearer to each other than half a thousandth of the depth of what they see (a step from one to the other
  // moves it by half a pixel where the focal length is a thousand; neighbours of a light field are several times as far
  // apart) and look the same way within five degrees. In metric frames only; frames of a video, which have times, have
  // none.
  explicit PhotoTwins(const Scene& scene);

  // keep[v] becomes false for the twins of each photo that is left out already; how many. None where fewer than half of
  // those kept would remain.
  int LeaveOut(std::vector<bool>& keep) const;

 private:
  std::vector<std::vector<int>> of_;  // each view's
};

}  // namespace lumi
