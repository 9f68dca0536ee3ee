// What a program would say while it works, kept to be read.
#pragma once

#include <string>

#include "scene/program/progress.h"

namespace lumi {

class MessagesKept : public ProgressSink {
 public:
  void Report(const std::string&, long, long, double, double) override {}
  void Finish(const std::string&, long, double) override {}
  void Message(const std::string& line) override { all += line + "\n"; }
  std::string all;
};

}  // namespace lumi
