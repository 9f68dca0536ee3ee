// H.264 may code the two fields of a frame as pictures of their own, and MPEG streams (AVCHD) hand on a packet for
// each. The decoder gives one frame for both, and none for a field whose other one is lost.
#pragma once

#include "scene/files/ffmpeg/owners.h"

namespace lumi::ffmpeg {

class SecondFields {
 public:
  enum Kind {
    kFrame,      // it begins a frame, or is one
    kSecond,     // the second field of the frame that the packet before began
    kAfterLone,  // it begins a frame; of the frame that the packet before began no other field comes
  };
  explicit SecondFields(const AVCodecParameters& codec);
  // To be asked of every packet, in the order of the file.
  Kind Of(const AVPacket& packet);
  bool any() const { return any_; }  // whether there was a second field

 private:
  CodecPtr context_;
  std::unique_ptr<AVCodecParserContext, FreeParser> parser_;  // none: this codec has no such packets
  int begun_ = 0;  // which field of a frame the packet before holds, where its other field is still missing; else 0
  bool any_ = false;
};

}  // namespace lumi::ffmpeg
