// When photos were taken, where the user knows: --times FILE.csv.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/options.h"
#include "reconstruct/photos.h"

namespace lumi {

struct ListedTime {
  std::string name;  // of the photo
  double time = 0;   // seconds, or turns of something that repeats itself (phase and whole turns before it)
  std::optional<int> frame_index;
};
struct ViewTimes {
  std::vector<ListedTime> photos;
  bool in_turns = false;  // the file has phases
};

// A first line of names says what the columns are: image (or name, file); time_s, or phase_deg or phase (0 to 1), then
// with period (or turn), the whole turns before; frame (or frame_index), or none. Columns of other names are passed
// over. Without such a line: name, seconds. Throws InputError naming file and line.
ViewTimes ReadViewTimes(const std::filesystem::path& csv);

// Photos that --times names, with their times (and frames) in seconds; a turn lasts --period-s, or a second. Photos
// that it does not name are left out and join the unreadable ones: in a scene that moves, a photo of no known moment is
// of no use. Throws DataError: fewer than two are named.
Capture WithTimes(const Capture& capture, const ReconstructOptions& options);

// The scene's period: --period-s, else a second where --times has phases; none otherwise.
std::optional<double> PeriodOfScene(const ReconstructOptions& options);

}  // namespace lumi
