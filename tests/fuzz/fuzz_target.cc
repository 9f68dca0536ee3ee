#include "tests/fuzz/fuzz_target.h"

#include <unistd.h>

#include <cstdlib>
#include <fstream>

#include "scene/program/error.h"

namespace lumi::fuzz {
namespace {
namespace fs = std::filesystem;

class OwnFolder {
 public:
  OwnFolder() {
    const char* asked = std::getenv("LUMI_FUZZ_FOLDER");
    std::error_code error;
    const fs::path memory = "/dev/shm";
    const fs::path parent = asked && *asked                   ? fs::path(asked)
                            : fs::is_directory(memory, error) ? memory
                                                              : fs::temp_directory_path();
    path_ = parent / ("lumi-fuzz-" + std::to_string(::getpid()));
    fs::create_directories(path_);
  }
  ~OwnFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  OwnFolder(const OwnFolder&) = delete;
  OwnFolder& operator=(const OwnFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

void CheckRefusal(const Error& e) {
  const std::string text = e.what();
  if (e.code() != ExitCode::kCorruptInput && e.code() != ExitCode::kDataRefused && e.code() != ExitCode::kUsage)
    throw ContractBroken("refused as if it were no fault of the input: " + text);
  if (text.empty()) throw ContractBroken("refused without a reason");
}

}  // namespace

std::vector<Target>& Targets() {
  static std::vector<Target> targets;
  return targets;
}

bool Register(const char* name, void (*read)(std::string_view bytes)) {
  Targets().push_back({name, read});
  return true;
}

const fs::path& InputFolder() {
  static const OwnFolder folder;
  return folder.path();
}

fs::path InputFile(const std::string& name, std::string_view bytes) {
  const fs::path file = InputFolder() / name;
  if (file.has_parent_path() && file.parent_path() != InputFolder()) fs::create_directories(file.parent_path());
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) throw std::runtime_error("no room for the input: " + file.string());
  return file;
}

bool Accepts(const Target& target, std::string_view bytes) {
  try {
    target.read(bytes);
    return true;
  } catch (const ContractBroken& e) {
    throw ContractBroken(target.name + ": " + e.what());
  } catch (const Error& e) {
    CheckRefusal(e);
    return false;
  } catch (const std::exception& e) {
    throw ContractBroken(target.name + ": an exception that is no Error: " + e.what());
  }
}

}  // namespace lumi::fuzz
