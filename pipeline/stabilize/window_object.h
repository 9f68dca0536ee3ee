// Which object a window of a long film keeps: --object and --object-point speak of one frame of the film, and a window
// knows its own frames only.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace lumi {

// The arguments for lumi-stabilize of a window of the frames `begin` to `end`: --object-frame, of the film's first
// frame where it is not given, counted from `begin`. None: the object's frame is not in it; `keeps_object`, the window
// goes on from one that kept the object, needs none.
std::optional<std::vector<std::string>> ObjectArguments(const std::vector<std::string>& arguments, int begin, int end,
                                                        bool keeps_object);

// Throws UsageError for --object-frame beyond a film of so many frames.
void RequireObjectFrame(const std::vector<std::string>& arguments, int frames);

}  // namespace lumi
