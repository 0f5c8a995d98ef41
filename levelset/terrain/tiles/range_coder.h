#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

/// Arithmetic coding of bits with probabilities that are learned on the way. A bit costs −log2 of
/// its probability. The coder is that of [Martin79]; it carries as LZMA does.
namespace levelset::terrain {

/// Probability that a bit is 0. The first bits that it sees change it most, so that it is learned
/// from few bits.
class BitModel {
 public:
  static constexpr int kBits = 15;
  /// Probability in units of 2^-kBits; never 0 or 1.
  [[nodiscard]] std::uint32_t zero() const { return static_cast<std::uint32_t>(zero_ >> 1); }
  void learn(unsigned bit) {
    const std::int32_t target = bit == 0 ? kOne - kLeast : kLeast;
    zero_ += (target - zero_) * kRates[seen_] >> kRateBits;
    if (seen_ + 1 < kRates.size()) ++seen_;
  }

 private:
  static constexpr std::int32_t kOne = 1 << 16, kLeast = 40;
  static constexpr int kRateBits = 15;
  /// Share by which the n-th bit changes the probability, in units of 2^-kRateBits.
  static constexpr std::array<std::uint16_t, 120> kRates = [] {
    std::array<std::uint16_t, 120> rates{};
    for (std::size_t n = 0; n < rates.size(); ++n)
      rates[n] = static_cast<std::uint16_t>(10 * (1 << kRateBits) / (10 * n + 16));
    return rates;
  }();
  std::int32_t zero_ = kOne / 2;
  std::uint32_t seen_ = 0;
};

class RangeEncoder {
 public:
  void bit(BitModel& model, unsigned bit) {
    const std::uint32_t bound = (range_ >> BitModel::kBits) * model.zero();
    if (bit == 0) {
      range_ = bound;
    } else {
      low_ += bound;
      range_ -= bound;
    }
    model.learn(bit);
    normalize();
  }
  /// Writes the lowest `count` bits of a number, the highest of them first.
  void rawBits(std::uint32_t bits, int count) {
    for (int n = count - 1; n >= 0; --n) {
      range_ >>= 1;
      if ((bits >> n & 1) != 0) low_ += range_;
      normalize();
    }
  }
  /// Ends the code and appends it. Zeros at its end are left out, as the decoder adds them.
  void finish(std::string& to) {
    for (int n = 0; n < 5; ++n) shiftLow();
    while (!bytes_.empty() && bytes_.back() == 0) bytes_.pop_back();
    if (bytes_.size() > 1) to.append(bytes_, 1);  // the first byte is always 0
  }

 private:
  void normalize() {
    while (range_ < std::uint32_t{1} << 24) {
      range_ <<= 8;
      shiftLow();
    }
  }
  /// Moves the highest byte of the lower bound out, once no carry can reach it any more.
  void shiftLow() {
    if (low_ < 0xff000000u || low_ > 0xffffffffu) {
      const auto carry = static_cast<unsigned char>(low_ >> 32);
      unsigned char byte = held_;
      for (; count_ > 0; --count_) {
        bytes_ += static_cast<char>(byte + carry);
        byte = 0xff;
      }
      held_ = static_cast<unsigned char>(low_ >> 24);
    }
    ++count_;
    low_ = (low_ & 0x00ffffffu) << 8;
  }

  std::string bytes_;
  std::uint64_t low_ = 0;
  std::uint32_t range_ = 0xffffffffu;
  unsigned char held_ = 0;  ///< last byte that may still change
  std::size_t count_ = 1;   ///< number of bytes that may still change: held_, then 0xff
};

/// Reads any bytes without failing; damage must be found by other means.
class RangeDecoder {
 public:
  explicit RangeDecoder(std::string_view bytes) : bytes_(bytes) {
    for (int n = 0; n < 4; ++n) code_ = code_ << 8 | next();
  }
  unsigned bit(BitModel& model) {
    const std::uint32_t bound = (range_ >> BitModel::kBits) * model.zero();
    const unsigned bit = code_ < bound ? 0 : 1;
    if (bit == 0) {
      range_ = bound;
    } else {
      code_ -= bound;
      range_ -= bound;
    }
    model.learn(bit);
    normalize();
    return bit;
  }
  std::uint32_t rawBits(int count) {
    std::uint32_t bits = 0;
    for (int n = 0; n < count; ++n) {
      range_ >>= 1;
      const std::uint32_t bit = code_ < range_ ? 0 : 1;
      code_ -= range_ * bit;
      bits = bits << 1 | bit;
      normalize();
    }
    return bits;
  }

 private:
  std::uint32_t next() {
    return at_ < bytes_.size() ? static_cast<unsigned char>(bytes_[at_++]) : 0;
  }
  void normalize() {
    while (range_ < std::uint32_t{1} << 24) {
      range_ <<= 8;
      code_ = code_ << 8 | next();
    }
  }

  std::string_view bytes_;
  std::size_t at_ = 0;
  std::uint32_t range_ = 0xffffffffu, code_ = 0;
};

}  // namespace levelset::terrain
