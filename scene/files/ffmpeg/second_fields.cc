#include "scene/files/ffmpeg/second_fields.h"

#include <utility>

namespace lumi::ffmpeg {

SecondFields::SecondFields(const AVCodecParameters& codec) {
  if (codec.codec_id != AV_CODEC_ID_H264) return;
  context_.reset(avcodec_alloc_context3(nullptr));
  if (!context_ || avcodec_parameters_to_context(context_.get(), &codec) < 0) return;
  parser_.reset(av_parser_init(codec.codec_id));
  if (parser_) parser_->flags |= PARSER_FLAG_COMPLETE_FRAMES;
}

SecondFields::Kind SecondFields::Of(const AVPacket& packet) {
  if (!parser_) return kFrame;
  std::uint8_t* picture = nullptr;
  int size = 0;
  parser_->picture_structure = AV_PICTURE_STRUCTURE_UNKNOWN;
  parser_->field_order = AV_FIELD_UNKNOWN;
  av_parser_parse2(parser_.get(), context_.get(), &picture, &size, packet.data, packet.size, packet.pts, packet.dts,
                   packet.pos);
  const int field = parser_->picture_structure;
  const bool is_field = field == AV_PICTURE_STRUCTURE_TOP_FIELD || field == AV_PICTURE_STRUCTURE_BOTTOM_FIELD;
  const int before = std::exchange(begun_, is_field ? field : 0);
  if (before == 0) return kFrame;
  // The parser knows an order where two fields have one frame's number: after a lost field, frames are found again.
  if (is_field && before != field && parser_->field_order != AV_FIELD_UNKNOWN) {
    begun_ = 0;
    any_ = true;
    return kSecond;
  }
  // Packets with both fields look like a row of one and the same field.
  return any_ || before != field ? kAfterLone : kFrame;
}

}  // namespace lumi::ffmpeg
