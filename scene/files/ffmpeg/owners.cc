#include "scene/files/ffmpeg/owners.h"

extern "C" {
#include <libavutil/error.h>
#include <libavutil/log.h>
}

#include <cctype>
#include <cstdarg>
#include <cstdio>
#include <mutex>

namespace lumi::ffmpeg {
namespace {

thread_local std::string last_words;

void Keep(void*, int level, const char* format, va_list arguments) {
  if (level > AV_LOG_ERROR) return;
  char line[300];
  std::vsnprintf(line, sizeof line, format, arguments);
  std::string said;
  for (const char* c = line; *c; ++c) said += std::iscntrl(static_cast<unsigned char>(*c)) ? ' ' : *c;
  while (!said.empty() && (said.back() == ' ' || said.back() == '.')) said.pop_back();
  if (!said.empty()) last_words = said;
}

}  // namespace

void KeepWords() {
  static std::once_flag once;
  std::call_once(once, [] { av_log_set_callback(Keep); });
}

void ForgetWords() { last_words.clear(); }

std::string Words(int error) {
  if (!last_words.empty()) return last_words;
  char text[AV_ERROR_MAX_STRING_SIZE] = {};
  av_strerror(error, text, sizeof text);
  return text;
}

}  // namespace lumi::ffmpeg
