// Photos taken from one and the same point, as from a tripod's head. They see every ray under one direction, so that S
// has equal rows where their f is 1. They stand in S as one photo, exactly: with S_ij = f_i f_j + (1 - f_i^2) [i = j]
// among them, photo i is f_i times the direction's radiance plus noise of variance 1 - f_i^2, and all of them together
// tell as much as one photo with f_g^2 = pi / (1 + pi), pi = sum f_i^2 / (1 - f_i^2 + nugget). Its weight is shared in
// proportion to f_i / (1 - f_i^2 + nugget): equal photos share equally.
#pragma once

#include <cstdint>
#include <vector>

#include "render/radiance/sources.h"

namespace lumi {

struct PhotoGroups {
  std::vector<std::int32_t> group;   // of each photo
  std::vector<std::int32_t> first;   // groups + 1, into member
  std::vector<std::int32_t> member;  // photos, ascending in a group; groups ascend by their first member
  int count() const { return static_cast<int>(first.size()) - 1; }
};

// Photos at exactly one centre (single: every photo is a group of its own).
PhotoGroups GroupByCentre(const RelativeSources& sources, bool single);

// f of a group from its members' f.
double GroupFactor(const float* f, int count);
// Share of the group's weight that each member takes. Writes `count` numbers; all 0 where every f is.
void MemberShares(const float* f, int count, double* share_out);

}  // namespace lumi
