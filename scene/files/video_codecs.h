// What videos are decoded and encoded with. Inside scene/files only. FFmpeg's libraries stand in a module beside the
// programs (ffmpeg/, liblumi_video.so) that is loaded when the first video is opened or written.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "scene/model/image.h"

namespace lumi {

// By this comment films of this suite are known again.
inline constexpr const char* kFilmComment = "made by Lumigraph";

// What a video file says of its video stream.
struct VideoClaims {
  double average_fps = 0;  // 0 where the file says none
  double nominal_fps = 0;  // the rate that all of its time stamps fit; 0 where that is unknown
  double tick_s = 0;       // the unit of its time stamps
  long frames = 0;         // that are shown; 0 where unknown
  bool counted = false;    // frames: the file states their number; else it follows from its length
  double duration_s = 0;   // of the frames, where a file without a count of frames states it; 0: not
  bool has_sound = false;
  int width = 0, height = 0;  // of the frames as they are shown
  std::vector<std::string> remarks;
};

struct VideoDecoder {
  virtual ~VideoDecoder() = default;
  virtual bool Grab() = 0;            // the next frame that is shown; false at the end
  virtual double StatedTime_s() = 0;  // of the frame just grabbed; NaN where the file says none
  virtual Image8 Picture() = 0;       // of the frame just grabbed: RGB, turned as it is shown; throws InputError
  virtual const VideoClaims& claims() = 0;
};

// In the order in which frames are shown; NaN where the file says none.
struct PacketTimes {
  std::vector<double> stated_s;
  VideoClaims claims;
};

struct VideoEncoder {
  virtual ~VideoEncoder() = default;
  virtual void Add(const Image8& rgb, std::int64_t tick) = 0;  // throws MachineError
  virtual void Finish() = 0;                                   // throws MachineError
};
struct VideoShape {
  int width = 0, height = 0;  // even
  double fps = 0;
  int ticks_per_s = 0;  // 0: a tick is a frame
};

struct VideoCodecs {
  std::unique_ptr<VideoDecoder> (*open)(const std::filesystem::path&, int threads);  // throws InputError, MachineError
  PacketTimes (*packet_times)(const std::filesystem::path&);                         // throws InputError
  std::string (*comment)(const std::filesystem::path&);  // the file's own; empty: none. Throws InputError
  // H.264 in an MP4 file that is made at once. Failures name `path`, which the caller shows its user for the file.
  std::unique_ptr<VideoEncoder> (*encode)(const std::filesystem::path& file, const std::filesystem::path& path,
                                          const VideoShape&, int threads);
};

// Throws MachineError where the module is missing.
const VideoCodecs& LoadVideoCodecs();

}  // namespace lumi
