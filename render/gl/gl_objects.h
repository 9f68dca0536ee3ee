// OpenGL names with an owner: released when it goes, movable, never copied. All of it needs a current context, on the
// thread that it is current on. Names are plain unsigned integers here, so that no GL header is shown.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace lumi {

// False once memory ran out: a driver that failed in the middle of its work may hold its own locks for ever, and what
// is to be torn down is left to the system, which takes it back as the program ends.
bool CanTearDownGl();

enum class GlKind { kBuffer, kTexture, kFramebuffer, kVertexArray };

template <GlKind kKind>
class GlObject {
 public:
  GlObject() = default;  // none
  static GlObject Make();
  ~GlObject() { Release(); }
  GlObject(GlObject&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
  GlObject& operator=(GlObject&& other) noexcept {
    if (this != &other) {
      Release();
      id_ = std::exchange(other.id_, 0);
    }
    return *this;
  }
  unsigned id() const { return id_; }
  explicit operator bool() const { return id_ != 0; }

 private:
  void Release();
  unsigned id_ = 0;
};

using GlBuffer = GlObject<GlKind::kBuffer>;
using GlTexture = GlObject<GlKind::kTexture>;
using GlFramebuffer = GlObject<GlKind::kFramebuffer>;
using GlVertexArray = GlObject<GlKind::kVertexArray>;

// A linked program: vertex + fragment, or compute.
class GlProgram {
 public:
  GlProgram() = default;
  // `name` is for messages: throws std::logic_error with the driver's log when the text does not compile or link.
  GlProgram(const std::string& name, const std::string& vertex, const std::string& fragment);
  GlProgram(const std::string& name, const std::string& compute);
  ~GlProgram();
  GlProgram(GlProgram&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
  GlProgram& operator=(GlProgram&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  unsigned id() const { return id_; }
  explicit operator bool() const { return id_ != 0; }
  void Use() const;
  int Uniform(const char* name) const;  // -1 where the compiler removed it; glUniform* ignores that

 private:
  unsigned id_ = 0;
};

// Fills a buffer, which is created if needed and stays bound. It gets new storage, because draws in progress may still
// read the old one. `data` nullptr: the storage is only allocated.
void FillBuffer(unsigned target, GlBuffer& buffer, const void* data, std::size_t bytes);
template <typename T>
void FillBuffer(unsigned target, GlBuffer& buffer, const std::vector<T>& data) {
  FillBuffer(target, buffer, data.data(), data.size() * sizeof(T));
}
// The same for a buffer that shaders read through a texture of this format, bound when it is made.
void FillTextureBuffer(GlBuffer& buffer, GlTexture& texture, unsigned format, const void* data, std::size_t bytes);
template <typename T>
void FillTextureBuffer(GlBuffer& buffer, GlTexture& texture, unsigned format, const std::vector<T>& data) {
  FillTextureBuffer(buffer, texture, format, data.data(), data.size() * sizeof(T));
}
// A texture of one level, bound: interpolated, held at its edges.
GlTexture MakePictureTexture(unsigned format, int width, int height);

// Throws MachineError unless the current context has OpenGL 4.3 core.
void RequireGl43();

// Throws MachineError (out of memory) or std::logic_error (anything else) if an OpenGL error is pending. `doing` says
// what was done, for the message.
void CheckGl(const char* doing);

// GL_RENDERER of the current context.
std::string GlDeviceName();
// Whether the current context draws on the CPU (llvmpipe, softpipe, SwiftShader).
bool GlIsSoftware();

}  // namespace lumi
