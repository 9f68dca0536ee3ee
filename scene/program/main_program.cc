#include "scene/program/main_program.h"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <new>
#include <nlohmann/json.hpp>

#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"
#include "scene/program/version.h"

namespace lumi {
namespace {

nlohmann::ordered_json WithSchema(const std::string& name, const nlohmann::ordered_json& body) {
  nlohmann::ordered_json j;
  j["schema"] = name;
  j["version"] = kVersion;
  for (const auto& [key, value] : body.items()) j[key] = value;
  return j;
}

int Report(const std::string& name, bool json, ExitCode code, const std::string& message, const std::string& file,
           const std::string& hint) {
  std::string line = name + ": ";
  if (!file.empty() && message.find(file) == std::string::npos) line += file + ": ";
  line += message;
  if (!hint.empty()) line += " (" + hint + ")";
  // Without fmt::print, which throws where nobody reads any more.
  std::fputs((line + "\n").c_str(), stderr);
  if (json) {
    nlohmann::ordered_json error;
    error["error"] = {{"code", static_cast<int>(code)}, {"file", file}, {"message", message}, {"hint", hint}};
    std::fputs((WithSchema(name, error).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n").c_str(), stdout);
  }
  return static_cast<int>(code);
}

}  // namespace

Program::Program(std::string name, std::string description)
    : name_(std::move(name)), app_(std::move(description), name_), sink_(MakeStderrProgress(true)) {
  app_.set_version_flag("--version", name_ + " " + kVersion);
  app_.add_flag("--json", json_, "Print a summary as JSON on stdout; messages go to stderr");
  app_.add_flag("--quiet", quiet_, "No progress, no remarks");
  app_.add_option("--threads", threads_, "Threads to use; 0 = all cores")->check(CLI::Range(0, 4096))->capture_default_str();
  app_.add_option("--seed", seed_, "Seed of everything random")->capture_default_str();
  app_.fallthrough();
  app_.get_formatter()->column_width(34);
}

int Program::Run(int argc, char** argv, const std::function<std::string()>& body,
                 const std::function<std::string(const std::string& json)>& for_people) {
  InstallInterruptHandler();
  try {
    app_.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app_.exit(e);  // --help, --version
    bool json = false;
    for (int i = 1; i < argc; ++i) json = json || std::string(argv[i]) == "--json";
    return Report(name_, json, ExitCode::kUsage, e.what(), "", "see " + name_ + " --help");
  }
  sink_ = MakeStderrProgress(quiet_);
  SetThreadCount(threads_);
  try {
    const std::string text = body();
    if (json_)
      std::fputs((WithSchema(name_, nlohmann::ordered_json::parse(text)).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n").c_str(), stdout);
    else if (for_people && !quiet_)
      std::fputs((for_people(text) + "\n").c_str(), stdout);
    if (std::fflush(stdout) != 0) throw MachineError("cannot write to standard output");
    return 0;
  } catch (const Error& e) {
    return Report(name_, json_, e.code(), e.what(), e.file().string(), e.hint());
  } catch (const std::bad_alloc&) {
    return Report(name_, json_, ExitCode::kMachine, "out of memory", "", "use smaller photos or fewer of them");
  } catch (const std::filesystem::filesystem_error& e) {
    return Report(name_, json_, ExitCode::kMachine, e.code().message(), e.path1().string(), "");
  } catch (const std::exception& e) {
    return Report(name_, json_, ExitCode::kBug, std::string("a bug of ours: ") + e.what(), "", "please report it with the command line");
  }
}

}  // namespace lumi
