#include "calibrate/gather.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>

#include "calibrate/detect_board.h"
#include "scene/files/image_io.h"
#include "scene/files/video.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr double kBlurredRatio = 1.8;  // of an edge's width to the median's: blurred
constexpr double kSameViewShare =
    0.02;  // of the diagonal: boards whose corners are nearer than that, on average, are one view

// Sizes of boards seen where the one asked for was not.
class OtherBoards {
 public:
  void Add(const BoardSearch& search) {
    // Three by three corners are found in windows and tiles, too.
    if (search.seen_columns > 3) ++seen_[{search.seen_columns, search.seen_rows}];
  }
  // In how many pictures one and the same other board is seen.
  int Count() const {
    int most = 0;
    for (const auto& [size, count] : seen_) most = std::max(most, count);
    return most;
  }
  // "9x6 inner corners are seen in 11", of the size seen most; empty: none.
  std::string Most() const {
    const auto most = std::ranges::max_element(seen_, [](const auto& a, const auto& b) { return a.second < b.second; });
    if (most == seen_.end()) return {};
    return fmt::format("{}x{} inner corners are seen in {}", most->first.first, most->first.second, most->second);
  }

 private:
  std::map<std::pair<int, int>, int> seen_;
};

void RequireBoards(const Gathered& gathered, const Board& board, const OtherBoards& others) {
  const int found = gathered.searched - gathered.without_board;
  // A part of a larger board passes for a smaller one now and then: the larger is seen in more.
  if (found > 0 && others.Count() <= 2 * found) return;
  const std::string none =
      fmt::format("the {}x{} board was found in {} of {} {}", board.columns, board.rows,
                  found > 0 ? std::to_string(found) : "none", gathered.searched, gathered.video ? "frames" : "photos");
  const std::string most = others.Most();
  // One picture may show a part of the right board.
  if (others.Count() > 1)
    throw DataError(none + ": the board's size is wrong, " + most,
                    "--board counts inner corners, where four squares meet");
  throw DataError(none + (most.empty() ? "" : ", " + most),
                  "--board counts inner corners; the whole board has to be in the picture, with a white margin");
}

Gathered FromPhotos(const fs::path& input, const Board& board, const GatherOptions& options, ProgressSink& progress) {
  const std::vector<fs::path> photos = PhotosOf(input);
  struct Outcome {
    int width = 0, height = 0;
    std::string unreadable;
    BoardSearch search;
  };
  std::vector<Outcome> outcomes(photos.size());
  Progress task(progress, "boards", static_cast<long>(photos.size()));
  ParallelEach(photos.size(), 1, [&](std::size_t i) {
    try {
      const Image8 photo = ReadImage8(photos[i]);
      outcomes[i].width = photo.width;
      outcomes[i].height = photo.height;
      outcomes[i].search = FindBoard(photo, board, options.corner_window_px);
    } catch (const InputError& e) {
      outcomes[i].unreadable = e.what();
    }
    task.Step();
  });

  Gathered gathered;
  gathered.pictures = static_cast<int>(photos.size());
  std::map<std::pair<int, int>, int> sizes;
  for (const Outcome& o : outcomes)
    if (o.unreadable.empty()) sizes[{o.width, o.height}] += o.search.found ? 1000 : 1;
  if (sizes.empty())
    throw InputError(photos[0],
                     photos.size() == 1 ? outcomes[0].unreadable : "no photo can be read: " + outcomes[0].unreadable);
  const auto most = std::ranges::max_element(sizes, [](const auto& a, const auto& b) { return a.second < b.second; });
  std::tie(gathered.width_px, gathered.height_px) = most->first;

  OtherBoards others;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const Outcome& o = outcomes[i];
    const std::string name = photos[i].filename().string();
    if (!o.unreadable.empty()) {
      gathered.refused.push_back({name, "unreadable: " + o.unreadable});
      continue;
    }
    ++gathered.searched;
    if (!o.search.found) {
      ++gathered.without_board;
      others.Add(o.search);
      gathered.refused.push_back({name, o.search.why_not});
    } else if (o.width != gathered.width_px || o.height != gathered.height_px) {
      gathered.refused.push_back({name, fmt::format("{}x{} pixels, the others have {}x{}", o.width, o.height,
                                                    gathered.width_px, gathered.height_px)});
    } else {
      gathered.views.push_back({name, o.search.found->corners_px, {}});
    }
  }
  RequireBoards(gathered, board, others);
  return gathered;
}

struct Candidate {
  int frame = 0;
  FoundBoard board;
};

double MeanDistance(const Candidate& a, const Candidate& b) {
  // Numbered from either end: a board turned by half a turn looks the same.
  double sum = 0, turned = 0;
  const std::size_t n = a.board.corners_px.size();
  for (std::size_t i = 0; i < n; ++i) {
    sum += (a.board.corners_px[i] - b.board.corners_px[i]).norm();
    turned += (a.board.corners_px[i] - b.board.corners_px[n - 1 - i]).norm();
  }
  return std::min(sum, turned) / static_cast<double>(n);
}

Gathered FromVideo(const fs::path& input, const Board& board, const GatherOptions& options, ProgressSink& progress) {
  VideoReader reader(input);
  Gathered gathered;
  gathered.video = true;
  gathered.width_px = reader.width();
  gathered.height_px = reader.height();
  // Where the file does not say how many frames it has, its packets are counted.
  const long stated = reader.frame_count_hint();
  const long frames = stated > 0 ? stated : static_cast<long>(ReadVideoTimes(input).time_s.size());
  const long window = std::max(1L, frames / options.video_candidates);

  std::vector<Candidate> candidates;
  OtherBoards others;
  Progress task(progress, "boards", frames);
  std::vector<VideoFrame> batch;  // the sharpest frame of each window, searched as many at once as there are threads
  const auto search = [&] {
    std::vector<BoardSearch> found(batch.size());
    ParallelEach(batch.size(), 1,
                 [&](std::size_t i) { found[i] = FindBoard(batch[i].rgb, board, options.corner_window_px); });
    for (std::size_t i = 0; i < batch.size(); ++i) {
      ++gathered.searched;
      if (found[i].found) {
        candidates.push_back({batch[i].index, *found[i].found});
      } else {
        ++gathered.without_board;
        others.Add(found[i]);
      }
    }
    batch.clear();
  };
  std::optional<VideoFrame> sharpest;
  double best = -1;
  long in_window = 0;
  while (auto frame = reader.Next()) {
    task.Step();
    if (const double s = window == 1 ? 0 : Sharpness(frame->rgb); s > best) best = s, sharpest = std::move(frame);
    if (++in_window < window) continue;
    batch.push_back(std::move(*sharpest));
    sharpest.reset(), best = -1, in_window = 0;
    if (batch.size() >= 2 * static_cast<std::size_t>(std::max(1, ThreadCount()))) search();
  }
  if (sharpest) batch.push_back(std::move(*sharpest));
  search();
  gathered.pictures = reader.frames_read();
  for (const std::string& remark : reader.remarks()) progress.Message(remark);
  if (gathered.pictures == 0) throw InputError(input, "the video has no frame that can be read");

  const auto view_of = [](const Candidate& c) {
    return BoardView{fmt::format("frame {:06d}", c.frame), c.board.corners_px, {}};
  };
  if (!candidates.empty()) {
    std::vector<double> widths;
    for (const Candidate& c : candidates) widths.push_back(c.board.edge_width_px);
    const double typical = Median(widths);
    std::vector<Candidate> sharp;
    for (const Candidate& c : candidates) {
      if (c.board.edge_width_px <= kBlurredRatio * typical)
        sharp.push_back(c);
      else
        gathered.refused.push_back(
            {view_of(c).name,
             fmt::format("blurred: edges {:.1f} px wide, {:.1f} in the median frame", c.board.edge_width_px, typical)});
    }
    // For coverage, the next frame taken is always the one whose board is farthest from the nearest board among those
    // taken; the first is the sharpest.
    const double same = kSameViewShare * std::hypot(gathered.width_px, gathered.height_px);
    std::vector<double> distance(sharp.size(), 1e30);
    std::vector<bool> taken(sharp.size());
    auto next = static_cast<std::size_t>(
        std::ranges::min_element(
            sharp, [](const auto& a, const auto& b) { return a.board.edge_width_px < b.board.edge_width_px; }) -
        sharp.begin());
    for (int count = 0; count < options.max_frames && count < static_cast<int>(sharp.size()) && distance[next] > same;
         ++count) {
      taken[next] = true;
      for (std::size_t i = 0; i < sharp.size(); ++i)
        distance[i] = taken[i] ? 0 : std::min(distance[i], MeanDistance(sharp[i], sharp[next]));
      next = static_cast<std::size_t>(std::ranges::max_element(distance) - distance.begin());
    }
    for (std::size_t i = 0; i < sharp.size(); ++i)
      if (taken[i])
        gathered.views.push_back(view_of(sharp[i]));
      else
        ++gathered.redundant;
  }
  RequireBoards(gathered, board, others);
  return gathered;
}

}  // namespace

// A folder in this one that holds photos, images/ first.
static fs::path PhotosInside(const fs::path& folder) {
  const auto holds = [](const fs::path& inner) {
    std::error_code error;
    for (fs::directory_iterator it(inner, error), end; !error && it != end; it.increment(error))
      if (it->is_regular_file(error) && HasImageExtension(it->path())) return true;
    return false;
  };
  if (holds(folder / "images")) return folder / "images";
  std::vector<fs::path> inner;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.is_directory() && holds(entry.path())) inner.push_back(entry.path());
  return inner.empty() ? fs::path() : *std::ranges::min_element(inner);
}

std::vector<fs::path> PhotosOf(const fs::path& input) {
  if (!fs::exists(input)) throw InputError(input, "there is no such file or folder");
  if (!fs::is_directory(input)) return {input};
  std::vector<fs::path> photos;
  for (const fs::directory_entry& entry : fs::directory_iterator(input))
    if (entry.is_regular_file() && HasImageExtension(entry.path()) &&
        !entry.path().filename().string().starts_with('.'))
      photos.push_back(entry.path());
  if (photos.empty()) {
    const fs::path inside = PhotosInside(input);
    throw InputError(input, "the folder holds no photos",
                     inside.empty() ? "give a folder of photos of a checkerboard, or a video"
                                    : "there are some in " + inside.string() + ": give that folder");
  }
  std::ranges::sort(photos);
  return photos;
}

Gathered GatherBoards(const fs::path& input, const Board& board, const GatherOptions& options, ProgressSink& progress) {
  const Stopwatch watch;
  const bool video = fs::is_regular_file(input) && HasVideoExtension(input);
  if (fs::is_regular_file(input) && !video && !HasImageExtension(input))
    throw InputError(input, "neither a photo nor a video");
  Gathered gathered = video ? FromVideo(input, board, options, progress) : FromPhotos(input, board, options, progress);
  gathered.seconds = watch.Seconds();
  return gathered;
}

}  // namespace lumi
