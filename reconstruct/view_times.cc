#include "reconstruct/view_times.h"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "reconstruct/known_cameras.h"
#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kTurnWithoutPeriod_s = 1;

std::string TrimmedCell(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r\""), last = text.find_last_not_of(" \t\r\"");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

std::vector<std::string> CellsOf(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream text(line);
  for (std::string cell; std::getline(text, cell, ',');) cells.push_back(TrimmedCell(cell));
  return cells;
}

std::optional<double> NumberIn(const std::string& cell) {
  char* end = nullptr;
  const double value = std::strtod(cell.c_str(), &end);
  return cell.empty() || *end != 0 || !std::isfinite(value) ? std::nullopt : std::optional(value);
}

// Which cell holds what; -1: none.
struct TimeColumns {
  int name = 0, time_s = 1, phase_deg = -1, phase = -1, turn = -1, frame = -1;
};

std::optional<TimeColumns> ReadHeader(const std::vector<std::string>& cells, const std::filesystem::path& csv) {
  TimeColumns c{.name = -1, .time_s = -1};
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::string& cell = cells[i];
    const auto at = static_cast<int>(i);
    if (cell == "image" || cell == "name" || cell == "file") c.name = at;
    if (cell == "time_s") c.time_s = at;
    if (cell == "phase_deg") c.phase_deg = at;
    if (cell == "phase") c.phase = at;
    if (cell == "period" || cell == "turn") c.turn = at;
    if (cell == "frame" || cell == "frame_index") c.frame = at;
  }
  if (c.name < 0 && c.time_s < 0 && c.phase_deg < 0 && c.phase < 0) return std::nullopt;
  const int clocks = (c.time_s >= 0 ? 1 : 0) + (c.phase_deg >= 0 ? 1 : 0) + (c.phase >= 0 ? 1 : 0);
  if (c.name < 0 || clocks != 1)
    throw InputError(csv, "line 1: a column image and one of time_s, phase_deg and phase are expected",
                     "see lumi-reconstruct --help, --times");
  return c;
}

}  // namespace

ViewTimes ReadViewTimes(const std::filesystem::path& csv) {
  std::istringstream text(ReadText(csv));
  ViewTimes times;
  TimeColumns columns;
  std::string line;
  for (int number = 1; std::getline(text, line); ++number) {
    const std::vector<std::string> cells = CellsOf(line);
    if (cells.empty() || (cells.size() == 1 && cells[0].empty())) continue;
    if (number == 1) {
      if (const auto header = ReadHeader(cells, csv)) {
        columns = *header;
        times.in_turns = columns.time_s < 0;
        continue;
      }
    }
    const auto number_at = [&](int column, const char* what) {
      const auto value =
          column < static_cast<int>(cells.size()) ? NumberIn(cells[static_cast<std::size_t>(column)]) : std::nullopt;
      if (!value) throw InputError(csv, fmt::format("line {}: the {} is no number", number, what));
      return *value;
    };
    ListedTime t;
    if (columns.name >= static_cast<int>(cells.size()) || cells[static_cast<std::size_t>(columns.name)].empty())
      throw InputError(csv, fmt::format("line {}: the photo's name is missing", number));
    t.name = cells[static_cast<std::size_t>(columns.name)];
    if (columns.time_s >= 0) t.time = number_at(columns.time_s, "time");
    if (columns.phase_deg >= 0) t.time = number_at(columns.phase_deg, "phase") / 360;
    if (columns.phase >= 0) t.time = number_at(columns.phase, "phase");
    if (columns.turn >= 0 && times.in_turns) t.time += number_at(columns.turn, "number of the turn");
    if (!std::isfinite(t.time)) throw InputError(csv, fmt::format("line {}: the time is too large", number));
    if (columns.frame >= 0) {
      const double frame = number_at(columns.frame, "number of the frame");
      if (frame != std::floor(frame) || std::abs(frame) > 1e9)
        throw InputError(csv, fmt::format("line {}: the number of the frame is not whole", number));
      t.frame_index = static_cast<int>(frame);
    }
    times.photos.push_back(t);
  }
  if (times.photos.empty()) throw InputError(csv, "no photo is listed");
  return times;
}

Capture WithTimes(const Capture& capture, const ReconstructOptions& options) {
  const ViewTimes times = ReadViewTimes(options.times);
  const double unit_s = times.in_turns ? options.period_s.value_or(kTurnWithoutPeriod_s) : 1;
  std::vector<std::string> names;
  for (const ListedTime& t : times.photos) names.push_back(t.name);
  const std::vector<int> match = MatchNames(names, capture.photos);
  Capture timed = capture;
  timed.photos.clear();
  for (std::size_t i = 0; i < capture.photos.size(); ++i) {
    InputPhoto photo = capture.photos[i];
    if (match[i] < 0) {
      timed.unreadable.push_back(
          {photo.name, "no time for it in " + options.times.filename().string(), "add it, or leave the photo out"});
      continue;
    }
    const ListedTime& listed = times.photos[static_cast<std::size_t>(match[i])];
    photo.time_s = unit_s * listed.time;
    photo.frame_index = listed.frame_index;
    timed.photos.push_back(std::move(photo));
  }
  if (timed.photos.size() < 2)
    throw DataError(fmt::format("{} of the {} listed times belong to photos here (the list has {}, the photos {})",
                                timed.photos.size(), names.size(), names.front(), capture.photos.front().name),
                    "names are compared without folder and ending", options.times);
  return timed;
}

std::optional<double> PeriodOfScene(const ReconstructOptions& options) {
  if (options.period_s || options.times.empty()) return options.period_s;
  return ReadViewTimes(options.times).in_turns ? std::optional(kTurnWithoutPeriod_s) : std::nullopt;
}

}  // namespace lumi
