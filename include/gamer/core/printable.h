#pragma once

#include <string>
#include <string_view>

namespace gamer {

/// `text` made safe for one line of a terminal. Line ends and tabs become \n, \r and \t. Other
/// control characters (of ASCII, and U+0080 to U+009F) and bytes that are not UTF-8 become \xNN.
/// Without this, file names and contents could move the cursor or imitate other lines.
std::string printable(std::string_view text);

/// `text` as a JSON string, with its quotation marks. Control characters and bytes that are not
/// UTF-8 become \u00NN.
std::string json_string(std::string_view text);

}  // namespace gamer
