// The frame of every program: common options, one clear line for each failure, the contract's exit codes, --json.
//
//   int main(int argc, char** argv) {
//     lumi::Program program("lumi-x", "what it does");
//     XOptions o;
//     program.options().Add("--width", o.width_px, "Of the pictures, pixels").Default();
//     program.RunAndExit(argc, argv, [&] { return RunX(o, program.progress()); });   // returns XSummary
//   }
//
// XSummary has ListKeys (scene/files/json_keys.h), what --json prints, and Describe, what a person reads; where it has
// ResultLine, too, that line is printed under --quiet.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "scene/program/answer.h"
#include "scene/program/command_line_problem.h"
#include "scene/program/error.h"
#include "scene/program/options.h"
#include "scene/program/progress.h"

namespace lumi {

class Program {
 public:
  Program(std::string name, std::string description);
  ~Program();
  Options& options() { return options_; }
  ProgressSink& progress() { return *sink_; }
  int threads() const { return threads_; }
  std::uint64_t seed() const { return seed_; }

  // A command, and what it does. It takes its own options, those that every program has, and `also` of the program's,
  // by name ("--effects") or by heading; others beside it are refused.
  Options Command(const std::string& name, const std::string& description, std::function<Answer()> body,
                  std::vector<std::string> also = {});

  // Parses, runs `body`, or the command that was given, prints the answer's JSON on stdout under --json, "schema" and
  // "version" in front of its keys, else its text; turns exceptions into one line and an exit code.
  int Run(int argc, char** argv, const std::function<Answer()>& body = {});
  // The same, and ends the process with that exit code, without destroying static objects.
  [[noreturn]] void RunAndExit(int argc, char** argv, const std::function<Answer()>& body = {});

 private:
  std::string name_;
  std::unique_ptr<CLI::App> app_;
  Options options_;
  std::vector<std::pair<Options, std::function<Answer()>>> commands_;
  TakenOptions taken_;
  std::unique_ptr<ProgressSink> sink_;
  bool json_ = false;
  bool quiet_ = false;
  int threads_ = 0;
  std::uint64_t seed_ = 0;
};

}  // namespace lumi
