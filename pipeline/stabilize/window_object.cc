#include "pipeline/stabilize/window_object.h"

#include <fmt/format.h>

#include "scene/program/error.h"
#include "scene/program/whole_number.h"

namespace lumi {
namespace {

constexpr const char* kObjectFrame = "--object-frame";

struct Split {
  std::optional<int> object_frame = 0;  // none: it is no number, of which lumi-stabilize says what is wrong
  std::vector<std::string> rest;
};
Split WithoutObjectFrame(const std::vector<std::string>& arguments) {
  Split split;
  for (std::size_t i = 0; i < arguments.size(); ++i)
    if (arguments[i] == kObjectFrame && i + 1 < arguments.size())
      split.object_frame = WholeNumber(arguments[++i]);
    else
      split.rest.push_back(arguments[i]);
  return split;
}

}  // namespace

std::optional<std::vector<std::string>> ObjectArguments(const std::vector<std::string>& arguments, int begin, int end,
                                                        bool keeps_object) {
  auto [frame, rest] = WithoutObjectFrame(arguments);
  if (!frame) return arguments;
  if (begin <= *frame && *frame <= end)
    rest.insert(rest.end(), {kObjectFrame, std::to_string(*frame - begin)});
  else if (!keeps_object)
    return std::nullopt;
  return rest;
}

void RequireObjectFrame(const std::vector<std::string>& arguments, int frames) {
  const auto frame = WithoutObjectFrame(arguments).object_frame;
  if (frame && *frame >= frames)
    throw UsageError(fmt::format("{} {}: the film has the frames 0 to {}", kObjectFrame, *frame, frames - 1),
                     "the frame of the film that --object speaks of");
}

}  // namespace lumi
