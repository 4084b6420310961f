// Stub of the parts of Google's Cardboard XR plug-in (1.12 and later, Apache-2.0) that the sample uses. Names are the
// plug-in's own.
namespace Google.XR.Cardboard
{
    public static class Api
    {
        public static bool IsTriggerPressed { get; set; }  // read-only in the plug-in
        public static bool IsGearButtonPressed { get; set; }
        public static bool IsCloseButtonPressed { get; set; }
        public static int Scans;  // only in the stub
        public static bool HasDeviceParams() { return Scans > 0; }
        public static void ScanDeviceParams() { Scans++; }
        public static bool HasNewDeviceParams() { return false; }
        public static void ReloadDeviceParams() { }
    }
}
