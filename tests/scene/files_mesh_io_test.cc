#include "scene/files/mesh_io.h"

#include <bit>
#include <cstring>

#include "files_test_util.h"

namespace lumi::test {
namespace {

Mesh Tetrahedron(bool colored) {
  Mesh mesh;
  mesh.vertices = {{0, 0, 0}, {1.0 / 3, 0, 0}, {0, 1e-7, 0}, {0, 0, -12345.678901234}};
  mesh.faces = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  if (colored) mesh.colors = {{1, 2, 3}, {255, 0, 128}, {9, 8, 7}, {0, 0, 0}};
  return mesh;
}

void ExpectSameMesh(const Mesh& a, const Mesh& b) {
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.faces, b.faces);
  EXPECT_EQ(a.colors, b.colors);
}

template <typename T>
void PutBig(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  if (std::endian::native == std::endian::little) std::reverse(raw, raw + sizeof(T));
  bytes.append(raw, sizeof(T));
}

TEST(MeshIo, PlyAndObjKeepEveryDigit) {
  const TempFolder folder;
  for (const bool colored : {false, true})
    for (const char* name : {"a.ply", "a.obj"}) {
      WriteMesh(folder / name, Tetrahedron(colored));
      ExpectSameMesh(ReadMesh(folder / name), Tetrahedron(colored));
    }
}

TEST(MeshIo, AnAsciiPlyOfPolygonsIsFanned) {
  const TempFolder folder;
  Write(folder / "a.ply",
        "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nelement vertex 5\r\nproperty float x\r\nproperty float "
        "y\r\nproperty float z\r\n"
        "property list uchar float weights\r\nelement face 2\r\nproperty uchar flags\r\nproperty list uchar int "
        "vertex_index\r\nend_header\r\n"
        "0 0 0 0\r\n1 0 0 2 5 6\r\n1 +1e0 0 0\r\n0 1 0 0\r\n.5 2 0 1 3\r\n9 4 0 1 2 3\r\n9 3 2 4 3\r\n");
  const Mesh mesh = ReadMesh(folder / "a.ply");
  EXPECT_EQ(mesh.vertices.size(), 5u);
  EXPECT_EQ(mesh.vertices[2], Eigen::Vector3d(1, 1, 0));
  EXPECT_EQ(mesh.faces, (std::vector<std::array<std::int32_t, 3>>{{0, 1, 2}, {0, 2, 3}, {2, 4, 3}}));
}

TEST(MeshIo, ABigEndianPlyOfFloatsWithColoursAndAForeignElementIsRead) {
  const TempFolder folder;
  std::string bytes =
      "ply\nformat binary_big_endian 1.0\nelement camera 1\nproperty double f\nelement vertex 3\nproperty float "
      "x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\nproperty list int uint "
      "vertex_indices\nend_header\n";
  PutBig(bytes, 50.0);
  for (int i = 0; i < 3; ++i) {
    PutBig(bytes, static_cast<float>(i == 1));
    PutBig(bytes, static_cast<float>(i == 2));
    PutBig(bytes, 0.25f);
    bytes += {static_cast<char>(200), 100, static_cast<char>(i)};
  }
  PutBig(bytes, std::int32_t{3});
  for (std::uint32_t i = 0; i < 3; ++i) PutBig(bytes, i);
  Write(folder / "a.ply", bytes);
  const Mesh mesh = ReadMesh(folder / "a.ply");
  EXPECT_EQ(mesh.vertices, (std::vector<Eigen::Vector3d>{{0, 0, 0.25}, {1, 0, 0.25}, {0, 1, 0.25}}));
  EXPECT_EQ(mesh.faces, (std::vector<std::array<std::int32_t, 3>>{{0, 1, 2}}));
  EXPECT_EQ(mesh.colors[2], (std::array<std::uint8_t, 3>{200, 100, 2}));
}

TEST(MeshIo, AnObjsCornersMayHaveTextureNormalsAndCountBackwards) {
  const TempFolder folder;
  Write(folder / "a.obj",
        "# by hand\nmtllib none.mtl\no thing\nv 0 0 0\nv 1 0 0\nvt 0 0\nvn 0 0 1\nv 1 1 0\nv 0 1 0\ns off\nf 1/1/1 "
        "2//1 3/1\nf -4 \\\n -2 -1\nl 1 2\n");
  const Mesh mesh = ReadMesh(folder / "a.obj");
  EXPECT_EQ(mesh.faces, (std::vector<std::array<std::int32_t, 3>>{{0, 1, 2}, {0, 2, 3}}));
}

std::string Ply(const std::string& vertices, const std::string& faces, const std::string& body) {
  return "ply\nformat ascii 1.0\nelement vertex " + vertices +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " + faces +
         "\nproperty list uchar int vertex_indices\nend_header\n" + body;
}

TEST(MeshIo, BrokenMeshesAreRefusedWithTheirReason) {
  const TempFolder folder;
  const auto refused = [&](const char* name, const std::string& content, const char* reason) {
    Write(folder / name, content);
    EXPECT_REFUSED(ExitCode::kCorruptInput, reason, ReadMesh(folder / name));
  };
  const std::string corners = "0 0 0\n1 0 0\n0 1 0\n";
  Write(folder / "good.ply", Ply("3", "1", corners + "3 0 1 2\n"));
  EXPECT_EQ(ReadMesh(folder / "good.ply").faces.size(), 1u);

  refused("a.ply", Ply("3", "1", "0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n"), "vertex 1 is not a finite number");
  refused("a.ply", Ply("3", "1", "0 0 0\n1 inf 0\n0 1 0\n3 0 1 2\n"), "vertex 1 is not a finite number");
  refused("a.ply", Ply("3", "1", corners + "3 0 1 3\n"), "face 0 names vertex 3 of 3");
  refused("a.ply", Ply("3", "1", corners + "3 0 1 -1\n"), "face 0 names vertex -1 of 3");
  refused("a.ply", Ply("3", "1", corners + "3 0 1 1.5\n"), "names vertex 1.5");
  refused("a.ply", Ply("3", "1", corners + "2 0 1\n"), "face 0 has 2 corners");
  refused("a.ply", Ply("3", "1", corners + "-3 0 1 2\n"), "negative length");
  refused("a.ply", Ply("3", "1", corners + "1e300 0 1 2\n"), "do not fit");
  refused("a.ply", Ply("3", "1", corners + "nan 0 1 2\n"), "face 0");
  refused("a.ply", Ply("3", "1", corners + "3 0 1"), "cut off");
  refused("a.ply", Ply("3", "1", "0 0 0\nx y z\n0 1 0\n3 0 1 2\n"), "\"x\" is no number");
  refused("a.ply", Ply("4000000000000", "1", corners + "3 0 1 2\n"), "4000000000000");
  refused("a.ply", Ply("3", "18446744073709551615", corners + "3 0 1 2\n"), "18446744073709551615");
  refused("a.ply", Ply("3", "0", corners), "point cloud");
  refused("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n", "x, y and z");
  refused("a.ply", "ply\nformat ascii 2\nelement vertex 1\n", "no end");
  refused("a.ply", "ply\nformat morse 1.0\n", "morse");
  refused("a.ply", "solid cube\n", "no PLY");
  refused("a.ply", "", "no PLY");
  refused("a.stl", "solid cube\n", "neither");
  refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "vertex 3 of 3");
  refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "line 4");
  refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "line 4");
  refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "2 corners");
  refused("a.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n", "not a finite");
  refused("a.obj", "v 0 0\n", "line 1");
  refused("a.obj", "v 0 0 0\n", "point cloud");
  refused("a.obj", "hello\n", "no vertices");

  // A binary file whose counts lie: refused by its size, before memory is asked for.
  WriteMesh(folder / "b.ply", Tetrahedron(false));
  std::string bytes = Read(folder / "b.ply");
  bytes.replace(bytes.find("element vertex 4"), 16, "element vertex 1999999999");
  refused("b.ply", bytes, "1999999999");
  WriteMesh(folder / "b.ply", Tetrahedron(false));
  fs::resize_file(folder / "b.ply", fs::file_size(folder / "b.ply") - 1);
  EXPECT_REFUSED(ExitCode::kCorruptInput, "cut off", ReadMesh(folder / "b.ply"));
}

TEST(MeshIo, TheCubesProxyIsRead) {
  const fs::path proxy = SharedData("cube/proxy.obj");
  if (!fs::exists(proxy)) GTEST_SKIP() << "no " << proxy;
  const Mesh mesh = ReadMesh(proxy);
  EXPECT_GT(mesh.faces.size(), 0u);
  const TempFolder folder;
  WriteMesh(folder / "proxy.ply", mesh);
  ExpectSameMesh(ReadMesh(folder / "proxy.ply"), mesh);
}

TEST(MeshIo, AFullDiskLeavesNoMesh) {
  const TempFolder folder;
  const FileSizeLimit limit(100);
  EXPECT_REFUSED(ExitCode::kMachine, "a.ply", WriteMesh(folder / "a.ply", Tetrahedron(true)));
  EXPECT_EQ(CountFiles(folder.path()), 0u);
}

}  // namespace
}  // namespace lumi::test
