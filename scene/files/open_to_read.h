// Opening a file to read it: that the machine is short of file handles or memory is no fault of the file.
#pragma once

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "scene/program/error.h"

namespace lumi {

// After a call that could not open `path`, with errno as it left it. Throws MachineError where the machine is short of
// file handles or memory; else returns.
inline void ThrowIfMachineIsShort(const std::filesystem::path& path, int error) {
  if (error == EMFILE || error == ENFILE)
    throw MachineError(std::string("cannot be opened: ") + std::strerror(error),
                       "close other programs, or allow more open files (ulimit -n)", path);
  if (error == ENOMEM) throw MachineError("cannot be opened: out of memory", "close other programs", path);
}

// Binary. Not open where there is no such file or it may not be read: the caller says so. Throws as above.
inline std::ifstream OpenToRead(const std::filesystem::path& path) {
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in) ThrowIfMachineIsShort(path, errno);
  return in;
}

}  // namespace lumi
