// Failures have a name, an exit code and a way out. Libraries throw these; only RunProgram (main_program.h) prints.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <utility>

namespace lumi {

enum class ExitCode : int {
  kDone = 0,
  kDataRefused = 1,   // the data do not allow it (why, and what to try)
  kUsage = 2,         // wrong usage
  kCorruptInput = 3,  // unreadable or corrupt input
  kMachine = 4,       // the machine does not allow it: disk full, no OpenGL, COLMAP missing
  kBug = 5,           // a bug of ours
  kInterrupted = 130,
};

class Error : public std::runtime_error {
 public:
  // message: one line, says what is wrong; file: the file it is about, or empty; hint: what to try, or empty.
  Error(ExitCode code, std::string message, std::filesystem::path file = {}, std::string hint = {})
      : std::runtime_error(std::move(message)), code_(code), file_(std::move(file)), hint_(std::move(hint)) {}
  ExitCode code() const { return code_; }
  const std::filesystem::path& file() const { return file_; }
  const std::string& hint() const { return hint_; }

 private:
  ExitCode code_;
  std::filesystem::path file_;
  std::string hint_;
};

struct DataError : Error {
  explicit DataError(std::string message, std::string hint = {}, std::filesystem::path file = {})
      : Error(ExitCode::kDataRefused, std::move(message), std::move(file), std::move(hint)) {}
};
struct UsageError : Error {
  explicit UsageError(std::string message, std::string hint = {})
      : Error(ExitCode::kUsage, std::move(message), {}, std::move(hint)) {}
};
struct InputError : Error {
  InputError(std::filesystem::path file, std::string message, std::string hint = {})
      : Error(ExitCode::kCorruptInput, std::move(message), std::move(file), std::move(hint)) {}
};
struct MachineError : Error {
  explicit MachineError(std::string message, std::string hint = {}, std::filesystem::path file = {})
      : Error(ExitCode::kMachine, std::move(message), std::move(file), std::move(hint)) {}
};
struct Interrupted : Error {
  Interrupted() : Error(ExitCode::kInterrupted, "interrupted") {}
};

}  // namespace lumi
