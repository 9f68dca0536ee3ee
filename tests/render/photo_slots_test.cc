// Which photos are held where not all fit: the decisions alone.
#include "render/photos/photo_slots.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

namespace lumi {
namespace {

// Photos 0 to 9 of one kind.
PhotoSlots Ten(PhotoRoom room) { return {std::vector<int>(10, 0), {room}}; }

void Want(PhotoSlots& slots, const std::vector<std::int32_t>& photos, int halvings = 0) {
  std::vector<PhotoSlots::Wish> wishes;
  for (const std::int32_t p : photos) wishes.push_back({p, halvings});
  slots.Want(wishes);
}

void Fetch(PhotoSlots& slots) {
  for (const PhotoSlots::Wish& m : slots.missing()) EXPECT_TRUE(slots.Place(m.photo, m.halvings).placed) << m.photo;
}

std::vector<std::int32_t> Held(const PhotoSlots& slots, int halvings) {
  std::vector<std::int32_t> held;
  for (std::int32_t p = 0; p < 10; ++p)
    if (slots.held(p) == halvings) held.push_back(p);
  return held;
}

using Photos = std::vector<std::int32_t>;

TEST(PhotoSlots, TheMostWantedAreWholeAndThoseAfterThemSmall) {
  PhotoSlots slots = Ten({5, 0, 3});
  Want(slots, {9, 8, 7, 6, 5, 4, 3, 2});
  const auto missing = slots.missing();
  ASSERT_EQ(missing.size(), 6U) << "four of five whole slots, two of three small ones";
  EXPECT_EQ(missing[0].photo, 9);
  EXPECT_EQ(missing[0].halvings, 0);
  EXPECT_EQ(missing[4].photo, 5);
  EXPECT_EQ(missing[4].halvings, 2);
  Fetch(slots);
  EXPECT_TRUE(slots.missing().empty());
  EXPECT_EQ(Held(slots, 0), (Photos{6, 7, 8, 9}));
  EXPECT_EQ(Held(slots, 2), (Photos{4, 5}));
  // A small one that matters more is read again, whole; its small slot is free then.
  Want(slots, {5, 9});
  ASSERT_EQ(slots.missing().size(), 1U);
  EXPECT_EQ(slots.missing()[0].photo, 5);
  Fetch(slots);
  EXPECT_EQ(Held(slots, 0), (Photos{5, 6, 7, 8, 9}));
  EXPECT_EQ(Held(slots, 2), (Photos{4}));
}

TEST(PhotoSlots, TheOneWantedLongestAgoMakesRoom) {
  PhotoSlots slots = Ten({3, 0, 1});
  for (const std::int32_t p : {0, 1, 2}) {
    Want(slots, {p});
    Fetch(slots);
  }
  Want(slots, {0, 3});
  const PhotoSlots::Placed placed = slots.Place(3, 0);
  EXPECT_TRUE(placed.placed);
  EXPECT_EQ(placed.dropped, 1);
  EXPECT_EQ(Held(slots, 0), (Photos{0, 2, 3}));
}

TEST(PhotoSlots, APhotoThatComesTooLateFindsNoRoom) {
  PhotoSlots slots = Ten({2, 0, 1});
  Want(slots, {0, 1});
  Want(slots, {2});
  Fetch(slots);
  EXPECT_TRUE(slots.Place(0, 0).placed) << "there is a free slot";
  Want(slots, {2});
  const PhotoSlots::Placed late = slots.Place(3, 0);
  EXPECT_TRUE(late.placed);
  EXPECT_EQ(late.dropped, 0);
  PhotoSlots one = Ten({1, 0, 1});
  Want(one, {4});
  Fetch(one);
  EXPECT_FALSE(one.Place(5, 0).placed) << "4 is wanted";
  EXPECT_EQ(one.held(4), 0);
}

// A camera that goes to and fro swaps the ranks of two photos at the limit.
TEST(PhotoSlots, PhotosAtTheLimitAreNotReadAgainAndAgain) {
  PhotoSlots slots = Ten({5, 0, 5});
  const Photos there{0, 1, 2, 3, 4, 5}, back{0, 1, 2, 4, 3, 5};
  Want(slots, there);
  Fetch(slots);
  Want(slots, back);
  Fetch(slots);
  for (int i = 0; i < 10; ++i) {
    Want(slots, i % 2 == 0 ? there : back);
    EXPECT_TRUE(slots.missing().empty()) << i;
  }
}

TEST(PhotoSlots, WhatIsFarAwayIsReadSmallAndStaysWhole) {
  PhotoSlots slots = Ten({5, 0, 3});
  Want(slots, {1, 2}, 2);
  Fetch(slots);
  EXPECT_EQ(Held(slots, 2), (Photos{1, 2}));
  Want(slots, {1});
  Fetch(slots);
  Want(slots, {1}, 2);
  EXPECT_TRUE(slots.missing().empty());
  EXPECT_EQ(slots.held(1), 0);
}

TEST(PhotoSlots, APhotoThatCannotBeReadIsNotMissing) {
  PhotoSlots slots = Ten({5, 0, 3});
  Want(slots, {1, 2});
  slots.GiveUp(1);
  ASSERT_EQ(slots.missing().size(), 1U);
  EXPECT_EQ(slots.missing()[0].photo, 2);
}

TEST(PhotoSlots, KindsDoNotTakeEachOthersSlots) {
  PhotoSlots slots({0, 0, 0, 1, 1}, {PhotoRoom{1, 0, 1}, PhotoRoom{1, 0, 0}});
  Want(slots, {0, 1, 2, 3, 4});
  const auto missing = slots.missing();
  ASSERT_EQ(missing.size(), 3U);
  EXPECT_EQ(missing[0].photo, 0);
  EXPECT_EQ(missing[1].photo, 1);
  EXPECT_EQ(missing[1].halvings, 2);
  EXPECT_EQ(missing[2].photo, 3);
  EXPECT_EQ(missing[2].halvings, 0);
}

// Whatever is wanted: never more than the slots, and what is wanted is there once it came, in its size or larger.
TEST(PhotoSlots, HoldForAnyOrderOfWishes) {
  std::mt19937 random(7);
  constexpr int kPhotos = 60;
  std::vector<int> kind(kPhotos);
  for (int& k : kind) k = static_cast<int>(random() % 3);
  const std::vector<PhotoRoom> room{{4, 5, 7}, {1, 0, 1}, {9, 3, 0}};
  PhotoSlots slots(kind, room);
  Photos all(kPhotos);
  std::iota(all.begin(), all.end(), 0);
  for (int round = 0; round < 500; ++round) {
    std::shuffle(all.begin(), all.end(), random);
    const Photos wanted(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(random() % kPhotos));
    Want(slots, wanted);
    // A photo that is held larger than wanted may have made room: it comes again.
    for (int pass = 0; pass < kSlotSizes; ++pass)
      for (const PhotoSlots::Wish& m : slots.missing()) ASSERT_TRUE(slots.Place(m.photo, m.halvings).placed);
    ASSERT_TRUE(slots.missing().empty());
    for (std::size_t k = 0; k < room.size(); ++k) {
      PhotoRoom held{};
      int of_kind = 0, asked = 0, least = 0;
      for (int p = 0; p < kPhotos; ++p)
        if (kind[static_cast<std::size_t>(p)] == static_cast<int>(k) && slots.held(p)) {
          ++held[static_cast<std::size_t>(*slots.held(p))];
          ++of_kind;
        }
      for (std::size_t h = 0; h < held.size(); ++h) {
        ASSERT_LE(held[h], room[k][h]);
        least += room[k][h] == 1 ? 1 : static_cast<int>(0.8 * room[k][h]);
      }
      for (const std::int32_t p : wanted) asked += kind[static_cast<std::size_t>(p)] == static_cast<int>(k) ? 1 : 0;
      ASSERT_GE(of_kind, std::min(asked, least));
    }
  }
}

}  // namespace
}  // namespace lumi
