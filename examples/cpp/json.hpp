// A reader of JSON, as small as the Spec of a model needs it.
#pragma once

#include <cmath>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace derain {

// One value of a document. An array has items; an object has items too, and a key for each.
struct Json {
  enum class Kind { null, boolean, number, text, array, object };

  Kind kind = Kind::null;
  double number = 0;  // of a boolean, 0 or 1
  std::string text;
  std::vector<Json> items;
  std::vector<std::string> keys;

  // The member of an object; null where there is none.
  const Json& operator[](const char* key) const {
    static const Json nothing;
    for (std::size_t place = 0; place < keys.size(); ++place) {
      if (keys[place] == key) return items[place];
    }
    return nothing;
  }

  bool is(Kind other) const { return kind == other; }
};

// Reads a document from its beginning to its end; throws std::runtime_error where it is none.
class JsonReader {
 public:
  explicit JsonReader(const std::string& text) : text_(text) {}

  Json document() {
    Json value = any(0);
    skip_blanks();
    if (place_ != text_.size()) fail("something after its end");
    return value;
  }

 private:
  // Deeper than any Spec; without it a hostile file could exhaust the stack.
  static constexpr int kDeepest = 64;

  Json any(int depth) {
    if (depth > kDeepest) fail("values nested too deep");
    skip_blanks();
    switch (peek()) {
      case '{': return object(depth);
      case '[': return array(depth);
      case '"': return text();
      default: return word_or_number();
    }
  }

  Json object(int depth) {
    Json value;
    value.kind = Json::Kind::object;
    expect('{');
    if (taken('}')) return value;
    do {
      skip_blanks();
      value.keys.push_back(text().text);
      expect(':');
      value.items.push_back(any(depth + 1));
    } while (taken(','));
    expect('}');
    return value;
  }

  Json array(int depth) {
    Json value;
    value.kind = Json::Kind::array;
    expect('[');
    if (taken(']')) return value;
    do {
      value.items.push_back(any(depth + 1));
    } while (taken(','));
    expect(']');
    return value;
  }

  Json text() {
    Json value;
    value.kind = Json::Kind::text;
    expect('"');
    while (peek() != '"') {
      const char next = text_[place_++];
      if (next == '\\') {
        value.text += escaped();
      } else {
        value.text += next;
      }
    }
    ++place_;
    return value;
  }

  // What stands after a backslash. Signs beyond ASCII, of which no name in a Spec that this
  // program looks at has any, become a question mark.
  char escaped() {
    const char kind = peek();
    ++place_;
    switch (kind) {
      case 'b': return '\b';
      case 'f': return '\f';
      case 'n': return '\n';
      case 'r': return '\r';
      case 't': return '\t';
      case 'u': {
        if (place_ + 4 > text_.size()) fail("a text that does not end");
        const long code = std::strtol(text_.substr(place_, 4).c_str(), nullptr, 16);
        place_ += 4;
        return code > 0 && code < 128 ? static_cast<char>(code) : '?';
      }
      default: return kind;
    }
  }

  // Python writes numbers that are none as NaN and Infinity, outside the standard.
  Json word_or_number() {
    const std::size_t begin = place_;
    while (place_ < text_.size() && std::string(",]} \t\r\n").find(text_[place_]) ==
                                        std::string::npos) {
      ++place_;
    }
    const std::string word = text_.substr(begin, place_ - begin);
    Json value;
    if (word == "null") return value;
    if (word == "true" || word == "false") {
      value.kind = Json::Kind::boolean;
      value.number = word == "true";
      return value;
    }
    value.kind = Json::Kind::number;
    char* end = nullptr;
    value.number = std::strtod(word.c_str(), &end);
    if (word.empty() || *end != '\0') fail("'" + word.substr(0, 40) + "', which is no value");
    return value;
  }

  void skip_blanks() {
    while (place_ < text_.size() &&
           std::string(" \t\r\n").find(text_[place_]) != std::string::npos) {
      ++place_;
    }
  }

  char peek() const {
    if (place_ >= text_.size()) fail("an end where a value should be");
    return text_[place_];
  }

  bool taken(char sign) {
    skip_blanks();
    if (peek() != sign) return false;
    ++place_;
    return true;
  }

  void expect(char sign) {
    if (!taken(sign)) fail(std::string("no '") + sign + "' where one should be");
  }

  [[noreturn]] static void fail(const std::string& reason) { throw std::runtime_error(reason); }

  const std::string& text_;
  std::size_t place_ = 0;
};

}  // namespace derain
