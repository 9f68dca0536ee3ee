// What photos are called in a scene, and which pose is whose.
#include "reconstruct/photo_names.h"

#include <gtest/gtest.h>

#include "reconstruct/known_cameras.h"

namespace lumi {
namespace {

using Names = std::vector<std::string>;

TEST(SceneNames, AreTheirOwnWhereThatCanBe) {
  const Names names = {"a photo.jpg",    "O'Hara \"x\".PNG", "-rf.jpg",  "10:30 100% %d.jpg", "day 1/b.jpg",
                       "gr\xc3\xbc.jpg", "TWIN.jpg",         "twin.jpg", "twin.png"};
  EXPECT_EQ(SceneNames(names), names);
}

TEST(SceneNames, EscapeWhatListsAndJsonCannotHold) {
  EXPECT_EQ(SceneNames({"a\nb.jpg", "caf\xe9.jpg", " c.jpg", "d\t.jpg", "e/ f.jpg"}),
            (Names{"a=0Ab.jpg", "caf=E9.jpg", "=20c.jpg", "d=09.jpg", "e/ f.jpg"}));
}

TEST(SceneNames, KeepApartWhatBecomesTheSame) {
  EXPECT_EQ(SceneNames({"a\nb.jpg", "a=0Ab.jpg"}), (Names{"a=0Ab=2.jpg", "a=0Ab.jpg"}));
}

TEST(SceneNames, LeaveRoomForEndings) {
  std::string umlauts;
  for (int i = 0; i < 125; ++i) umlauts += "\xc3\xbc";
  const Names names = SceneNames({std::string(251, 'n') + ".jpg", std::string(250, 'n') + "m.jpg", umlauts + ".jpg"});
  for (const std::string& name : names) {
    EXPECT_LE(name.size(), 200U);
    EXPECT_TRUE(name.ends_with(".jpg"));
  }
  EXPECT_NE(names[0], names[1]);
  EXPECT_EQ(SceneNames(names), names) << "whole characters";
}

TEST(MatchNames, TellsPhotosApartByWhateverTheyDifferIn) {
  const auto photos = [](const Names& names) {
    std::vector<InputPhoto> list;
    for (const std::string& name : names) {
      InputPhoto photo;
      photo.name = name;
      list.push_back(photo);
    }
    return list;
  };
  using Found = std::vector<int>;
  EXPECT_EQ(MatchNames({"same.png", "same.jpg", "SAME.jpg"}, photos({"SAME.jpg", "same.jpg", "same.png"})),
            (Found{2, 1, 0}));
  EXPECT_EQ(MatchNames({"images/0001.png", "images/0002.png"}, photos({"0002.png", "0001.png"})), (Found{1, 0}));
  EXPECT_EQ(MatchNames({"viff.001.ppm"}, photos({"viff001.png"})), (Found{0}));
  EXPECT_EQ(MatchNames({"a.1.png", "a1.png"}, photos({"a-1.jpg"})), (Found{-1})) << "either";
  const Names rig = {"images/cam00/0000.png", "images/cam01/0000.png"}, here = {"cam01/0000.png", "cam00/0000.png"};
  EXPECT_EQ(MatchNames(rig, photos(here)), (Found{1, 0})) << "cameras are named from the folder above";
  EXPECT_EQ(MatchNames(here, photos(rig)), (Found{1, 0}));
  EXPECT_EQ(MatchNames({"set/cam00/0000", "set/cam01/0000"}, photos(here)), (Found{1, 0}));
  EXPECT_EQ(MatchNames(rig, photos({"0000.png"})), (Found{-1}));
  auto renamed = photos({"caf=E9.jpg"});
  renamed[0].original = "caf\xe9.jpg";
  EXPECT_EQ(MatchNames({"b.jpg", "caf\xe9.jpg"}, renamed), (Found{1}));
}

}  // namespace
}  // namespace lumi
