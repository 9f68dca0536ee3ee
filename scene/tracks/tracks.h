// Feature tracks: where single points of the world are seen in the frames of a video, or in unordered photos.
// What projective factorisation, time-periodic calibration and stabilisation start from.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace lumi {

struct TrackObservation {
  int frame = -1;                                  // into Tracks::frames
  Eigen::Vector2d x_px = Eigen::Vector2d::Zero();  // pixels, the corner of the image is (0, 0)
};

struct Track {
  std::vector<TrackObservation> observations;  // frames ascending, each at most once
  std::array<std::uint8_t, 3> color{};         // RGB where it was seen first
};

struct Tracks {
  struct Frame {
    std::string name;  // file name of the photo
    Eigen::Vector2i size_px = Eigen::Vector2i::Zero();
  };
  std::vector<Frame> frames;
  std::vector<Track> tracks;
};

}  // namespace lumi
