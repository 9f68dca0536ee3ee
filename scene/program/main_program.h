// The frame of every program: common options, one clear line for each failure, the contract's exit codes, --json.
//
//   int main(int argc, char** argv) {
//     lumi::Program program("lumi-x", "what it does");
//     XOptions options;
//     program.app().add_option(...);
//     return program.Run(argc, argv, [&] { return RunX(options, program.progress()); });   // returns JSON text
//   }
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>

#include "scene/program/error.h"
#include "scene/program/progress.h"

namespace lumi {

class Program {
 public:
  Program(std::string name, std::string description);
  CLI::App& app() { return app_; }
  ProgressSink& progress() { return *sink_; }
  bool json() const { return json_; }
  int threads() const { return threads_; }
  std::uint64_t seed() const { return seed_; }

  // Parses, runs `body`, prints its JSON text on stdout under --json (a person gets `for_people`'s text instead, where
  // given), turns exceptions into one line and an exit code. `body` returns a JSON object's text; "schema" and
  // "version" are put in front of its keys.
  int Run(int argc, char** argv, const std::function<std::string()>& body,
          const std::function<std::string(const std::string& json)>& for_people = {});

 private:
  std::string name_;
  CLI::App app_;
  std::unique_ptr<ProgressSink> sink_;
  bool json_ = false;
  bool quiet_ = false;
  int threads_ = 0;
  std::uint64_t seed_ = 0;
};

}  // namespace lumi
