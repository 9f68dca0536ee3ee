// A folder that processes fill together, perhaps on several machines: frames of a path, depth maps. A stamp in it, a
// text of a line for each thing, says what its files follow from. Whoever brings another text is refused with the first
// difference, and nothing is removed.
//
//   const FilledInParts maps{folder, "made-from.txt", "depth maps", IsMap, Difference, "give all parts ..."};
//   maps.Join(text);                                    a part: its files may lie beside those of others
//   if (!maps.Keeps(text)) { clear; maps.Stamp(text); } the whole: takes what is there, or begins anew
#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "scene/program/error.h"

namespace lumi {

// What a folder holds was made in parts from something else.
struct PartsDiffer final : UsageError {
  using UsageError::UsageError;
};

class FilledInParts {
 public:
  using IsOneOf = bool (*)(const std::filesystem::path& file);
  using InWords = std::string (*)(const std::string& there, const std::string& here);
  // stamp: the text's file name. what: its files, in a message; counts: whether a file is one of them. difference: of
  // two texts, in words. way_out: a hint.
  FilledInParts(std::filesystem::path folder, std::string stamp, std::string what, IsOneOf counts, InWords difference,
                std::string way_out);

  // For a part. Parts may start at the same time: the first one's text counts. Throws PartsDiffer where the folder's
  // files follow from something else, UsageError where they do not say from what.
  void Join(const std::string& text) const;
  // For the whole: whether the folder's files follow from this text. Throws PartsDiffer where they were made in parts
  // from another.
  bool Keeps(const std::string& text) const;
  void Stamp(const std::string& text) const;

  bool MadeInParts() const;
  // They are complete, and count as those of one run from now on.
  void ForgetParts() const;
  std::filesystem::path stamp() const { return folder_ / stamp_; }

 private:
  [[noreturn]] void Refuse(const std::string& there, const std::string& here) const;

  std::filesystem::path folder_;
  std::string stamp_, what_;
  IsOneOf counts_;
  InWords difference_;
  std::string way_out_;
};

// The first pieces between `at` that differ; nothing in place of a piece that only the other has.
std::pair<std::string, std::string> FirstDifference(const std::string& a, const std::string& b, const std::string& at);
// "there X, here Y".
std::string ThereAndHere(const std::string& there, const std::string& here);

}  // namespace lumi
