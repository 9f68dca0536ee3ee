// H.264 may code the two fields of a frame as pictures of their own, and MPEG streams (AVCHD) hand on a packet for
// each. The decoder gives one frame for both.
#pragma once

#include "scene/files/ffmpeg/owners.h"

namespace lumi::ffmpeg {

class SecondFields {
 public:
  explicit SecondFields(const AVCodecParameters& codec);
  // Whether this packet is the second field of the frame that the packet before began. To be asked of every packet, in
  // the order of the file.
  bool Holds(const AVPacket& packet);

 private:
  CodecPtr context_;
  std::unique_ptr<AVCodecParserContext, FreeParser> parser_;  // none: this codec has no such packets
  int begun_ = 0;  // which field of a frame the packet before holds, where its other field is still missing; else 0
};

}  // namespace lumi::ffmpeg
