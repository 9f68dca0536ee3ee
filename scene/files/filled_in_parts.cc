#include "scene/files/filled_in_parts.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <vector>

#include "scene/files/atomic_file.h"
#include "scene/files/provenance.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

std::vector<std::string> Split(const std::string& text, const std::string& at) {
  std::vector<std::string> pieces;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t end = std::min(text.find(at, from), text.size());
    pieces.push_back(text.substr(from, end - from));
    from = end + at.size();
  }
  return pieces;
}

}  // namespace

std::pair<std::string, std::string> FirstDifference(const std::string& a, const std::string& b, const std::string& at) {
  std::vector<std::string> in_a = Split(a, at), in_b = Split(b, at);
  const std::size_t most = std::max(in_a.size(), in_b.size());
  in_a.resize(most);
  in_b.resize(most);
  const auto [one, other] = std::ranges::mismatch(in_a, in_b);
  return one == in_a.end() ? std::pair<std::string, std::string>() : std::pair(*one, *other);
}

std::string ThereAndHere(const std::string& there, const std::string& here) {
  return fmt::format("there {}, here {}", there.empty() ? "nothing" : there, here.empty() ? "nothing" : here);
}

FilledInParts::FilledInParts(fs::path folder, std::string stamp, std::string what, IsOneOf counts, InWords difference,
                             std::string way_out)
    : folder_(std::move(folder)),
      stamp_(std::move(stamp)),
      what_(std::move(what)),
      counts_(counts),
      difference_(difference),
      way_out_(std::move(way_out)) {}

void FilledInParts::Refuse(const std::string& there, const std::string& here) const {
  throw PartsDiffer(
      fmt::format("{} holds {} that do not join with these: {}", folder_.string(), what_, difference_(there, here)),
      way_out_);
}

void FilledInParts::Join(const std::string& text) const {
  fs::create_directories(folder_);
  if (!fs::exists(stamp())) {
    for (const auto& entry : fs::directory_iterator(folder_))
      if (counts_(entry.path()))
        throw UsageError(fmt::format("{} holds {} of a run that did not say what they are of", folder_.string(), what_),
                         "remove the folder");
    char host[64] = {};
    (void)::gethostname(host, sizeof host - 1);
    const fs::path own = folder_ / fmt::format(".{}-{}-{}", stamp_, HashOf(host), ::getpid());
    WriteTextAtomically(own, text);
    std::error_code taken;  // set where another part made the stamp first
    fs::create_hard_link(own, stamp(), taken);
    fs::remove(own, taken);
    if (!fs::exists(stamp())) WriteTextAtomically(stamp(), text);  // no hard links
  }
  if (const std::string there = ReadText(stamp()); there != text) Refuse(there, text);
  if (!MadeInParts()) WriteTextAtomically(folder_ / kMadeInParts, "");
}

bool FilledInParts::Keeps(const std::string& text) const {
  std::error_code error;
  if (!fs::exists(stamp(), error)) return false;
  const std::string there = ReadText(stamp());
  if (there == text) return true;
  if (MadeInParts()) Refuse(there, text);
  return false;
}

void FilledInParts::Stamp(const std::string& text) const { WriteTextAtomically(stamp(), text); }

bool FilledInParts::MadeInParts() const {
  std::error_code error;
  return fs::exists(folder_ / kMadeInParts, error);
}

void FilledInParts::ForgetParts() const {
  std::error_code error;
  fs::remove(folder_ / kMadeInParts, error);
}

}  // namespace lumi
