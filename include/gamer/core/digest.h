#pragma once

#include <string>
#include <string_view>

namespace gamer {

/// 128 bits of a text as 32 hexadecimal digits. Equal digests of different texts are unlikely
/// beyond any use, but can be made on purpose. The digest depends on the machine's byte order.
std::string digest(std::string_view text);

}  // namespace gamer
