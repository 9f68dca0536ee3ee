// Interlaced frames hold two pictures, one in the even and one in the odd lines, half a frame's time apart. They become
// pictures of one moment.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>

#include "scene/files/ffmpeg/filter_graph.h"

namespace lumi::ffmpeg {

// As the file marks the frame. Cameras and editing programs mark frames of one moment, too.
bool MarkedInterlaced(const AVFrame& frame);

// Successive frames that are marked as interlaced: whether most of those that something moves in are of one moment all
// the same. None where nothing moves.
std::optional<bool> OfOneMoment(const std::deque<const AVFrame*>& frames, int threads);

// Keeps the lines of the field that was filmed first and makes the others from it and from the fields before and after
// (FFmpeg's filter bwdif). A frame comes out for each that is sent, in order. Frames that are not marked as interlaced
// come out as they are.
class Deinterlacer {
 public:
  explicit Deinterlacer(std::filesystem::path path) : path_(std::move(path)) {}
  // For frames like this one. False where this FFmpeg lacks the filter, or has none for such frames.
  bool Prepare(const AVFrame& like, int threads);
  bool Takes(const AVFrame& frame) const;         // of the size and colours that it was prepared for
  void Send(AVFrame& frame, std::int64_t stamp);  // throws InputError
  void End();                                     // no frame follows
  // False: another frame has to be sent first, or after End: all came out. Throws InputError.
  bool Receive(AVFrame& frame, std::int64_t& stamp);
  bool ended() const { return ended_; }

 private:
  void Check(int error) const;
  std::filesystem::path path_;
  Colours colours_;  // of all frames
  FilterGraph graph_;
  std::deque<std::int64_t> stamps_;  // of the frames inside
  std::int64_t sent_ = 0;
  bool ended_ = false;
};

}  // namespace lumi::ffmpeg
