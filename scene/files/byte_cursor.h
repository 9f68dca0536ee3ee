// Walks over bytes in memory and never beyond their end, for the binary formats here. Inside scene/files only.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>

#include "scene/program/error.h"

namespace lumi {

class ByteCursor {
 public:
  ByteCursor(std::string_view bytes, std::filesystem::path file, bool swap_bytes = false)
      : bytes_(bytes), file_(std::move(file)), swap_(swap_bytes) {}

  std::size_t remaining() const { return bytes_.size() - at_; }
  const std::filesystem::path& file() const { return file_; }

  template <typename T>
  T Read(const char* what) {
    Require(1, sizeof(T), what);
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data() + at_, sizeof(T));
    if (swap_) std::reverse(raw.begin(), raw.end());
    at_ += sizeof(T);
    return std::bit_cast<T>(raw);
  }

  // A count of things of at least `bytes_each`: checked against what is left before anybody allocates by it.
  template <typename T>
  std::size_t ReadCount(std::size_t bytes_each, const char* what) {
    const auto count = static_cast<std::uint64_t>(Read<T>(what));
    Require(count, bytes_each, what);
    return static_cast<std::size_t>(count);
  }

  // Up to the next zero byte, which is eaten.
  std::string ReadString(const char* what) {
    const std::size_t end = bytes_.find('\0', at_);
    if (end == std::string_view::npos)
      throw InputError(file_, std::string(what) + " does not end before the file does");
    std::string text(bytes_.substr(at_, end - at_));
    at_ = end + 1;
    return text;
  }

  void Require(std::uint64_t count, std::size_t bytes_each, const char* what) const {
    if (count > remaining() / bytes_each)
      throw InputError(file_, std::string(what) + ": " + std::to_string(count) + " of them do not fit into the " +
                                  std::to_string(remaining()) + " bytes that are left: the file is cut off or corrupt");
  }

 private:
  std::string_view bytes_;
  std::filesystem::path file_;
  bool swap_;
  std::size_t at_ = 0;
};

template <typename T>
void AppendLittleEndian(std::string& bytes, T value) {
  static_assert(std::endian::native == std::endian::little, "bytes are put as they are in memory");
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace lumi
