#include "render/viewer/picture_texture.h"

#include <epoxy/gl.h>

namespace lumi {

void PictureTexture::Set(const ImageF& picture) {
  size_px_ = {picture.width, picture.height};
  glActiveTexture(GL_TEXTURE0);
  texture_ = MakePictureTexture(GL_RGBA32F, picture.width, picture.height);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, picture.width, picture.height, GL_RGBA, GL_FLOAT, picture.data.data());
  CheckGl("uploading a refined picture");
}

}  // namespace lumi
