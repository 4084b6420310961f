// Of Google's Cardboard XR plug-in (1.12 and later, Apache-2.0) what the sample uses, by the same names.
namespace Google.XR.Cardboard
{
    public static class Api
    {
        public static bool IsTriggerPressed { get; set; }  // the plug-in's can't be set
        public static bool IsGearButtonPressed { get; set; }
        public static bool IsCloseButtonPressed { get; set; }
        public static int Scans;  // of the stub
        public static bool HasDeviceParams() { return Scans > 0; }
        public static void ScanDeviceParams() { Scans++; }
        public static bool HasNewDeviceParams() { return false; }
        public static void ReloadDeviceParams() { }
    }
}
