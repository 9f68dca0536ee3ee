// The 256 cases of a cube, each derived from its faces.
#include <algorithm>

#include "proxy/hull/contour.h"

namespace lumi {
namespace {

int CubeEdge(int a, int b) {  // between two neighbouring corners
  const int axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
  const int low = std::min(a, b);
  if (axis == 0) return low >> 1;
  if (axis == 1) return 4 + (low & 1) + ((low >> 2) << 1);
  return 8 + (low & 3);
}

// Corners of each face in a circle; all six in the same sense seen from outside.
constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

struct EdgeFaces {
  std::array<unsigned, 12> faces{};  // bit f: lies in face f
  EdgeFaces() {
    for (unsigned f = 0; f < 6; ++f)
      for (int c = 0; c < 4; ++c)
        faces[static_cast<std::size_t>(CubeEdge(kFaces[f][c], kFaces[f][(c + 1) % 4]))] |= 1U << f;
  }
};

// Triangles for loop[first..last] with no diagonal in a face; false where there is none.
bool Triangulate(const std::vector<std::int8_t>& loop, std::size_t first, std::size_t last, const EdgeFaces& edges,
                 std::vector<std::array<std::int8_t, 3>>& out) {
  if (last - first < 2) return true;
  const auto allowed = [&](std::size_t a, std::size_t b) {
    const bool neighbours = b - a == 1 || (a == 0 && b + 1 == loop.size());
    return neighbours ||
           (edges.faces[static_cast<std::size_t>(loop[a])] & edges.faces[static_cast<std::size_t>(loop[b])]) == 0;
  };
  // Apexes from the middle outwards: even triangles before long fans.
  const std::size_t count = last - first - 1;
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t half = (count - 1) / 2, step = (n + 1) / 2;
    const std::size_t m = first + 1 + (n % 2 == 1 ? half + step : half - step);
    if (!allowed(first, m) || !allowed(m, last)) continue;
    const std::size_t before = out.size();
    out.push_back({loop[first], loop[m], loop[last]});
    if (Triangulate(loop, first, m, edges, out) && Triangulate(loop, m, last, edges, out)) return true;
    out.resize(before);
  }
  return false;
}

CubeCase MakeCase(unsigned inside, const EdgeFaces& edges) {
  const auto in = [&](int corner) { return (inside >> corner & 1U) != 0; };
  std::array<int, 12> next;
  next.fill(-1);
  for (const auto& face : kFaces) {
    // Around each run of corners outside, from where the circle enters the solid again back to where it left it.
    for (int c = 0; c < 4; ++c) {
      if (!in(face[c]) || in(face[(c + 1) % 4])) continue;
      int end = c + 1;
      while (!in(face[(end + 1) % 4])) ++end;
      next[static_cast<std::size_t>(CubeEdge(face[end % 4], face[(end + 1) % 4]))] =
          CubeEdge(face[c], face[(c + 1) % 4]);
    }
  }
  CubeCase result;
  std::array<bool, 12> seen{};
  for (std::size_t e = 0; e < 12; ++e) {
    if (next[e] < 0 || seen[e]) continue;
    std::vector<std::int8_t> loop;
    for (std::size_t at = e; !seen[at]; at = static_cast<std::size_t>(next[at])) {
      seen[at] = true;
      loop.push_back(static_cast<std::int8_t>(at));
    }
    const std::size_t before = result.triangles.size();
    if (Triangulate(loop, 0, loop.size() - 1, edges, result.triangles)) continue;
    result.triangles.resize(before);
    const auto centre = static_cast<std::int8_t>(CubeCase::kCentre + static_cast<int>(result.centres.size()));
    for (std::size_t i = 0; i < loop.size(); ++i)
      result.triangles.push_back({loop[i], loop[(i + 1) % loop.size()], centre});
    result.centres.push_back(std::move(loop));
  }
  return result;
}

}  // namespace

const CubeCase& CaseOf(unsigned inside) {
  static const std::vector<CubeCase> cases = [] {
    const EdgeFaces edges;
    std::vector<CubeCase> all;
    for (unsigned i = 0; i < 256; ++i) all.push_back(MakeCase(i, edges));
    return all;
  }();
  return cases[inside];
}

}  // namespace lumi
