// A video's frames, encoded on a thread of their own while the window draws the next. The file appears, under a name
// that was free, only when it is complete.
#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>

#include "scene/files/json_keys.h"
#include "scene/model/image.h"

namespace lumi {

// The name itself where nothing is there, else NAME_001.EXT, NAME_002.EXT ...
std::filesystem::path FreeName(const std::filesystem::path& wanted);

struct Video {
  std::string file;
  long frames = 0;
};
inline void ListKeys(JsonKeys& j, Video& v) { j("file", v.file, "frames", v.frames); }

class Recorder {
 public:
  // Throws UsageError for an invalid rate or name.
  Recorder(const std::filesystem::path& wanted, double fps);
  ~Recorder();  // without Finish: cancelled
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  bool Full() const;     // frames wait to be encoded: come back later
  void Add(Image8 rgb);  // of one size, 3 channels
  // No more frames; Ended() tells when the file is there. The last one is repeated until there are `frames`.
  void Finish(long frames = 0);
  void Cancel();  // leaves no file

  enum class State { kOpen, kFinishing, kWritten, kFailed, kCancelled };
  State state() const { return Get(state_); }
  bool Ended() const { return state() > State::kFinishing; }  // written, failed or cancelled
  long added() const { return added_; }
  long encoded() const { return Get(encoded_); }
  // Once it ended: the file, or what went wrong.
  std::filesystem::path file() const { return Get(file_); }
  std::string problem() const { return Get(problem_); }

 private:
  template <typename T>
  T Get(const T& member) const {
    const std::lock_guard lock(mutex_);
    return member;
  }
  void Work();
  void WriteAll(const std::filesystem::path& hidden);

  // Frames that wait: more would fill memory where drawing is faster than encoding.
  static constexpr std::size_t kMaxWaiting = 4;

  const std::filesystem::path wanted_;
  const double fps_;
  mutable std::mutex mutex_;
  std::condition_variable change_;
  std::deque<Image8> waiting_;
  State state_ = State::kOpen;
  bool no_more_ = false, cancel_ = false;
  long added_ = 0, encoded_ = 0, least_ = 0;
  std::filesystem::path file_;
  std::string problem_;
  std::thread thread_;
};

}  // namespace lumi
