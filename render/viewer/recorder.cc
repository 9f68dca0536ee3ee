#include "render/viewer/recorder.h"

#include <fmt/format.h>

#include <exception>
#include <optional>

#include "scene/files/atomic_file.h"
#include "scene/files/video.h"
#include "scene/program/error.h"
#include "scene/program/out_of_memory.h"

namespace lumi {

namespace fs = std::filesystem;

fs::path FreeName(const fs::path& wanted) {
  fs::path name = wanted;
  for (int i = 1; fs::exists(fs::symlink_status(name)); ++i)
    name = wanted.parent_path() / fmt::format("{}_{:03d}{}", wanted.stem().string(), i, wanted.extension().string());
  return name;
}

// Another program may take the free name before the file is moved there: creating a link never overwrites.
static fs::path MoveToFreeName(const fs::path& from, const fs::path& wanted) {
  for (;;) {
    const fs::path name = FreeName(wanted);
    std::error_code error;
    fs::create_hard_link(from, name, error);
    if (error == std::errc::file_exists) continue;
    if (error) {
      fs::rename(from, name);  // a file system without hard links
    } else {
      fs::remove(from);
    }
    return name;
  }
}

Recorder::Recorder(const fs::path& wanted, double fps) : wanted_(wanted), fps_(fps) {
  if (wanted.extension() != ".mp4")
    throw UsageError("a video is an .mp4, not " + wanted.filename().string(), "name it FILE.mp4");
  thread_ = std::thread([this] { Work(); });
}

Recorder::~Recorder() {
  {
    const std::lock_guard lock(mutex_);
    if (!no_more_) cancel_ = true;
  }
  change_.notify_all();
  thread_.join();
}

bool Recorder::Full() const {
  const std::lock_guard lock(mutex_);
  return waiting_.size() >= kMaxWaiting;
}

void Recorder::Add(Image8 rgb) {
  {
    const std::lock_guard lock(mutex_);
    if (no_more_ || cancel_) return;  // it ended by itself: state() says how
    waiting_.push_back(std::move(rgb));
    ++added_;
  }
  change_.notify_all();
}

void Recorder::Finish(long frames) {
  {
    const std::lock_guard lock(mutex_);
    no_more_ = true;
    if (state_ == State::kOpen) {
      state_ = State::kFinishing;
      least_ = frames;
    }
  }
  change_.notify_all();
}

void Recorder::Cancel() {
  {
    const std::lock_guard lock(mutex_);
    cancel_ = true;
  }
  change_.notify_all();
}

void Recorder::Work() {
  const fs::path hidden = TemporaryBeside(fs::path(wanted_).replace_extension(".mp4"), "r");
  RemoveStaleTemporariesOf(wanted_);
  const FolderInUse in_use(wanted_.parent_path());
  State end = State::kWritten;
  fs::path file;
  std::string problem;
  try {
    WriteAll(hidden);
    if (Get(cancel_))
      end = State::kCancelled;
    else
      file = MoveToFreeName(hidden, wanted_);
  } catch (const std::exception& e) {
    MemoryIsBack();
    end = State::kFailed;
    problem = e.what();
  }
  std::error_code ignored;
  fs::remove(hidden, ignored);
  const std::lock_guard lock(mutex_);
  state_ = end;
  file_ = file;
  problem_ = problem;
  waiting_.clear();
  no_more_ = true;
}

void Recorder::WriteAll(const fs::path& hidden) {
  VideoWriter video(hidden, fps_);
  std::optional<Image8> picture;
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      change_.wait(lock, [this] { return cancel_ || no_more_ || !waiting_.empty(); });
      if (cancel_) return;
      if (!waiting_.empty()) {
        picture = std::move(waiting_.front());
        waiting_.pop_front();
      } else if (!picture || encoded_ >= least_) {
        break;
      }
    }
    video.Add(*picture);
    const std::lock_guard lock(mutex_);
    ++encoded_;
  }
  video.Finish();
}

}  // namespace lumi
