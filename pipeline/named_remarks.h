// Remarks of several programs at once, each with its name; their progress would draw over each other.
#pragma once

#include <mutex>
#include <string>
#include <utility>

#include "scene/program/progress.h"

namespace lumi {

class NamedRemarks final : public ProgressSink {
 public:
  // An empty name: remarks as they are.
  NamedRemarks(ProgressSink& to, std::mutex& mutex, std::string name)
      : to_(to), mutex_(mutex), name_(std::move(name)) {}
  void Report(const std::string&, long, long, double, double) override {}
  void Finish(const std::string&, long, double) override {}
  void Message(const std::string& line) override {
    const std::lock_guard lock(mutex_);
    to_.Message(name_.empty() ? line : name_ + ": " + line);
  }

 private:
  ProgressSink& to_;
  std::mutex& mutex_;
  const std::string name_;
};

}  // namespace lumi
