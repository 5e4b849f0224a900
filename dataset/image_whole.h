#pragma once
// Is an image file whole? Decoders fill the missing part of a truncated file with grey and say
// nothing.

#include <string>
#include <string_view>

namespace rugae {

/// `bytes` is a whole PNG, JPEG or BMP; throws Error "NAME: truncated or not an image", or "NAME:
/// damaged: ..." when a PNG chunk does not match its checksum.
void check_image_is_whole(const std::string& name, std::string_view bytes);

}  // namespace rugae
